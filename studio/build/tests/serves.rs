//! The server by its connections: what a browser gets, and what those who are none.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::thread;

use studio_build::files::Files;
use studio_build::server::Server;

/// A server of a page that has a folder above it.
fn server() -> u16 {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page");
    fs::create_dir(&page).unwrap();
    fs::write(folder.path().join("Cargo.toml"), "secret").unwrap();
    fs::write(page.join("index.html"), "<html>").unwrap();
    fs::write(page.join("tmcl_studio.wasm"), vec![7; 3_000_000]).unwrap();
    let server = Server::bind(Files::read(&page).unwrap(), 0).unwrap();
    let port = server.port();
    // To the end of the process.
    thread::spawn(move || server.run());
    port
}

/// The head and the body of what bytes get, of which there are no more.
fn send(port: u16, bytes: &[u8]) -> (String, Vec<u8>) {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.write_all(bytes).unwrap();
    stream.shutdown(Shutdown::Write).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap();
    let body = answer.split_off(end + 4);
    (String::from_utf8(answer).unwrap(), body)
}

fn ask(port: u16, method: &str, path: &str) -> (String, Vec<u8>) {
    send(port, format!("{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n").as_bytes())
}

/// The status of what bytes get.
fn status(port: u16, bytes: &[u8]) -> String {
    let (head, _) = send(port, bytes);
    head.lines().next().unwrap().to_owned()
}

#[test]
fn a_browser_gets_the_files_of_the_page() {
    let port = server();
    let (head, body) = ask(port, "GET", "/");
    assert_eq!(body, b"<html>");
    // Written out, so that nobody loosens the policy unnoticed.
    let expected = "HTTP/1.1 200 OK\r\n\
        Content-Type: text/html; charset=utf-8\r\n\
        Content-Length: 6\r\n\
        X-Content-Type-Options: nosniff\r\n\
        Cache-Control: no-cache\r\n\
        Referrer-Policy: no-referrer\r\n\
        Cross-Origin-Resource-Policy: same-origin\r\n\
        Connection: close\r\n\
        Content-Security-Policy: default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; \
        img-src 'self' data:; connect-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; \
        frame-ancestors 'none'\r\n\r\n";
    assert_eq!(head, expected);
    assert_eq!(ask(port, "HEAD", "/"), (expected.to_owned(), vec![]));
    let (head, body) = ask(port, "GET", "/tmcl_studio.wasm?1");
    assert!(head.contains("\r\nContent-Type: application/wasm\r\nContent-Length: 3000000\r\n"), "{head}");
    assert!(body == vec![7; 3_000_000]);
}

#[test]
fn nobody_gets_anything_else() {
    let port = server();
    for path in ["/../Cargo.toml", "/%2e%2e/x", "/%2e%2e/Cargo.toml", "/page/../../Cargo.toml", "/..%2fCargo.toml"] {
        let (head, body) = ask(port, "GET", path);
        assert!(head.starts_with("HTTP/1.1 404 Not Found\r\n"), "{path}: {head}");
        assert_eq!(body, b"The page has no such file.\n", "{path}");
        assert!(head.contains("\r\nContent-Security-Policy: default-src 'none'; "), "{path}: {head}");
    }
}

#[test]
fn what_is_no_request_of_a_browser_is_refused() {
    let port = server();
    let post = format!("POST / HTTP/1.1\r\nHost: localhost:{port}\r\nContent-Length: 50000\r\n\r\n");
    let (head, _) = send(port, (post + &"x".repeat(50_000)).as_bytes());
    assert!(head.starts_with("HTTP/1.1 405 Method Not Allowed\r\nAllow: GET, HEAD\r\n"), "{head}");
    let other = format!("GET / HTTP/1.1\r\nHost: example.org:{port}\r\n\r\n");
    assert_eq!(status(port, other.as_bytes()), "HTTP/1.1 421 Misdirected Request");
    assert_eq!(status(port, b"GET / HTTP/1.1\r\n\r\n"), "HTTP/1.1 421 Misdirected Request");
    assert_eq!(status(port, b"GET / HT"), "HTTP/1.1 400 Bad Request");
    assert_eq!(status(port, b"\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03"), "HTTP/1.1 400 Bad Request");
    let long = format!("GET / HTTP/1.1\r\nCookie: {}\r\n\r\n", "x".repeat(17 * 1024));
    assert_eq!(status(port, long.as_bytes()), "HTTP/1.1 431 Request Header Fields Too Large");
}

#[test]
fn those_who_ask_nothing_are_in_nobodys_way() {
    let port = server();
    let silent: Vec<_> = (0..60).map(|_| TcpStream::connect(("127.0.0.1", port)).unwrap()).collect();
    assert_eq!(ask(port, "GET", "/").1, b"<html>");
    for stream in silent {
        stream.set_nonblocking(true).unwrap();
        assert_eq!(stream.peek(&mut [0]).unwrap_err().kind(), ErrorKind::WouldBlock, "it was closed for the other one");
    }
    // Whoever leaves has left; these are more than are served at once.
    (0..200).for_each(|_| drop(TcpStream::connect(("127.0.0.1", port)).unwrap()));
    assert_eq!(ask(port, "GET", "/").1, b"<html>");
}
