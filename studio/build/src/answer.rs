//! The answer that a browser gets for a request.

use std::fmt::Write;

use crate::files::Files;
use crate::policy;
use crate::request::{Fault, Request};

/// Headers that every answer has, beside those that tell its body and the policy.
const HEADERS: [(&str, &str); 5] = [
    ("X-Content-Type-Options", "nosniff"),
    ("Cache-Control", "no-cache"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Connection", "close"),
];

/// An answer. Nothing in it comes from the request.
#[derive(Clone, Copy, Debug)]
pub struct Answer<'a> {
    /// The text behind the version in the first line, and the header that belongs to it if there is one.
    status: &'static str,
    /// The kind of the text, as a browser is told it.
    kind: &'static str,
    text: &'a [u8],
    /// Whether only the head is asked for.
    is_head: bool,
}

impl<'a> Answer<'a> {
    /// The answer to a request of the server at a port. The server is meant only if the browser believes to ask it. A
    /// page of others, whose name has become that of this computer, is not to read what is here.
    pub fn to(request: &[u8], files: &'a Files, port: u16) -> Self {
        let request = match Request::parse(request) {
            Ok(request) => request,
            Err(Fault::Malformed) => return Self::refusal("400 Bad Request", "This is no request.\n"),
            Err(Fault::TooLong) => {
                return Self::refusal("431 Request Header Fields Too Large", "The request is too long.\n");
            }
        };
        let is_head = request.method == "HEAD";
        Self { is_head, ..Self::whole(&request, files, port) }
    }

    fn whole(request: &Request, files: &'a Files, port: u16) -> Self {
        let host = request.host.as_deref().unwrap_or_default();
        if !["127.0.0.1", "localhost"].iter().any(|name| host == format!("{name}:{port}")) {
            return Self::refusal("421 Misdirected Request", "Ask for the address that cargo studio has printed.\n");
        }
        if !["GET", "HEAD"].contains(&request.method.as_str()) {
            return Self::refusal("405 Method Not Allowed\r\nAllow: GET, HEAD", "Files are here to be read only.\n");
        }
        let path = if request.path == "/" { "/index.html" } else { &request.path };
        match path.strip_prefix('/').and_then(|path| files.get(path)) {
            Some(file) => Self { status: "200 OK", kind: file.kind, text: &file.bytes, is_head: false },
            None => Self::refusal("404 Not Found", "The page has no such file.\n"),
        }
    }

    fn refusal(status: &'static str, sentence: &'static str) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", text: sentence.as_bytes(), is_head: false }
    }

    /// The lines of the answer before the body.
    pub fn head(&self) -> String {
        let (status, kind, length, policy) = (self.status, self.kind, self.text.len(), policy::header());
        let mut head = format!("HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n");
        for (name, value) in HEADERS.iter().chain(&[("Content-Security-Policy", policy.as_str())]) {
            // Writing to memory does not fail.
            let _ = write!(head, "{name}: {value}\r\n");
        }
        head + "\r\n"
    }

    /// The body of the answer.
    pub fn body(&self) -> &'a [u8] {
        if self.is_head { &[] } else { self.text }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files() -> Files {
        let mut files = Files::default();
        files.add("index.html", b"<html>".to_vec()).unwrap();
        files.add("plot/a.js", b"1".to_vec()).unwrap();
        files
    }

    /// The status and the body of what a request gets at port 8080.
    fn ask(method: &str, path: &str, host: &str) -> (String, String) {
        let (files, request) = (files(), format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"));
        let answer = Answer::to(request.as_bytes(), &files, 8080);
        (answer.status.into(), String::from_utf8(answer.body().into()).unwrap())
    }

    #[test]
    fn files_are_found_by_their_paths() {
        assert_eq!(ask("GET", "/", "127.0.0.1:8080"), ("200 OK".into(), "<html>".into()));
        assert_eq!(ask("HEAD", "/", "127.0.0.1:8080"), ("200 OK".into(), "".into()));
        assert_eq!(ask("GET", "/plot/a.js?1", "localhost:8080"), ("200 OK".into(), "1".into()));
        for path in ["/plot", "//index.html", "/./index.html", "/../Cargo.toml", "/%69ndex.html", "/index.html/"] {
            assert_eq!(ask("GET", path, "localhost:8080").0, "404 Not Found", "{path}");
        }
    }

    #[test]
    fn other_hosts_and_methods_are_refused() {
        for host in ["", "localhost", "localhost:80", "localhost:80800", "127.0.0.1.example:8080", "[::1]:8080"] {
            assert_eq!(ask("GET", "/", host).0, "421 Misdirected Request", "{host}");
        }
        for method in ["POST", "get", "OPTIONS"] {
            assert_eq!(ask(method, "/", "localhost:8080").0, "405 Method Not Allowed\r\nAllow: GET, HEAD", "{method}");
        }
    }
}
