//! The request of a browser, in bytes. A request that is not plainly one is none: whoever means this server sends no
//! others.

/// The longest request, in bytes.
pub const LIMIT: usize = 16 * 1024;

/// The head of a request, as far as an answer depends on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// The method, which tells what is to be done, such as `GET`.
    pub method: String,
    /// Of what, such as `/index.html`; what follows a question mark is cut off.
    pub path: String,
    /// Whom the browser believes to ask, such as `127.0.0.1:8080`.
    pub host: Option<String>,
}

/// Why bytes are no request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The bytes are not what the protocol has, or are less than a request.
    Malformed,
    /// The bytes are more than [`LIMIT`].
    TooLong,
}

impl Request {
    /// The request that bytes are, which end with the empty line after the headers.
    pub fn parse(bytes: &[u8]) -> Result<Self, Fault> {
        if bytes.len() > LIMIT {
            return Err(Fault::TooLong);
        }
        // What is not UTF-8, as cookies of other programs may be, is in headers that do not matter, or names no file.
        Self::of(&String::from_utf8_lossy(bytes)).ok_or(Fault::Malformed)
    }

    fn of(text: &str) -> Option<Self> {
        let mut lines = text.strip_suffix("\r\n\r\n")?.split("\r\n");
        let first: Vec<_> = lines.next()?.split(' ').collect();
        let [method, target, "HTTP/1.0" | "HTTP/1.1"] = first[..] else { return None };
        if !is_word(method) || !target.starts_with('/') || target.contains(char::is_control) {
            return None;
        }
        let path = target.split('?').next()?;
        let mut host = None;
        for line in lines {
            let (name, value) = line.split_once(':')?;
            let value = value.trim_matches([' ', '\t']);
            if !is_word(name) || value.contains(|letter: char| letter.is_control() && letter != '\t') {
                return None;
            }
            if name.eq_ignore_ascii_case("host") && host.replace(value.to_owned()).is_some() {
                return None;
            }
        }
        Some(Self { method: method.into(), path: path.into(), host })
    }
}

/// Whether this is what the protocol has as the names of methods and headers.
fn is_word(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|letter| letter.is_ascii_alphanumeric() || "!#$%&'*+-.^_`|~".contains(letter))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_has_method_path_and_host() {
        let bytes = b"GET /a.js?b=c?d HTTP/1.1\r\nCookie: \xff\r\nhOST:\t127.0.0.1:80 \r\nAccept:\r\n\r\n";
        let request = Request { method: "GET".into(), path: "/a.js".into(), host: Some("127.0.0.1:80".into()) };
        assert_eq!(Request::parse(bytes), Ok(request));
        let request = Request { method: "brew".into(), path: "/".into(), host: None };
        assert_eq!(Request::parse(b"brew / HTTP/1.0\r\n\r\n"), Ok(request));
    }

    #[test]
    fn what_the_protocol_does_not_have_is_malformed() {
        let malformed = [
            "",
            "\r\n\r\n",
            "GET\r\n\r\n",
            "GET /\r\n\r\n",
            "GET / HTTP/1.1",
            "GET / HTTP/1.1\r\n",
            "GET / HTTP/1.1\n\n",
            "GET / HTTP/2.0\r\n\r\n",
            "GET / HTTP/1.1 \r\n\r\n",
            "GET  / HTTP/1.1\r\n\r\n",
            " GET / HTTP/1.1\r\n\r\n",
            "\r\nGET / HTTP/1.1\r\n\r\n",
            "G(T / HTTP/1.1\r\n\r\n",
            "GET a.js HTTP/1.1\r\n\r\n",
            "GET http://127.0.0.1/ HTTP/1.1\r\n\r\n",
            "GET /\0 HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.1\r\nHost\r\n\r\n",
            "GET / HTTP/1.1\r\nHost : a\r\n\r\n",
            "GET / HTTP/1.1\r\n: a\r\n\r\n",
            "GET / HTTP/1.1\r\nA: b\r\n c: d\r\n\r\n",
            "GET / HTTP/1.1\r\nA: b\nC: d\r\n\r\n",
            "GET / HTTP/1.1\r\nA: \u{1b}[2J\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a\r\nHost: a\r\n\r\n",
            "GET / HTTP/1.1\r\n\r\nbody",
        ];
        for text in malformed {
            assert_eq!(Request::parse(text.as_bytes()), Err(Fault::Malformed), "{text:?}");
        }
    }

    #[test]
    fn what_is_longer_than_the_limit_is_too_long() {
        let request = |length: usize| format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(length - 18)).into_bytes();
        assert_eq!(request(LIMIT).len(), LIMIT);
        assert!(Request::parse(&request(LIMIT)).is_ok());
        assert_eq!(Request::parse(&request(LIMIT + 1)), Err(Fault::TooLong));
    }

    /// Any beginning of a request, and any request with a byte that is another, is read without a panic.
    #[test]
    fn nothing_panics() {
        let whole = b"GET /a?b HTTP/1.1\r\nHost: a\r\n\r\n";
        for at in 0..whole.len() {
            assert!(Request::parse(&whole[..at]).is_err());
            for byte in 0..=255 {
                let mut other = *whole;
                other[at] = byte;
                let _ = Request::parse(&other);
            }
        }
    }
}
