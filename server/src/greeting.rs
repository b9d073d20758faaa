//! The beginning of a connection to a TCP port, which tells who connects: a host of modules, or a web browser.
//!
//! Any web page can make a browser connect to a port of this computer and send there what the page likes. What it likes
//! comes behind the method of a request of HTTP and a blank, though, or behind the hello of TLS. So the first bytes of
//! a connection are held back until it is known whether they are that.

use tmcm::tmcl::binary::{self, TELEGRAM};

/// Methods of HTTP (RFC 9110, PATCH of RFC 5789, PRI of RFC 9113, QUERY) and of WebDAV (RFC 4918). There are others,
/// and a page may make up more: they are known by what follows them, which is no operand of a command.
const METHODS: [&str; 18] = [
    "CONNECT",
    "COPY",
    "DELETE",
    "GET",
    "HEAD",
    "LOCK",
    "MKCOL",
    "MOVE",
    "OPTIONS",
    "PATCH",
    "POST",
    "PRI",
    "PROPFIND",
    "PROPPATCH",
    "PUT",
    "QUERY",
    "TRACE",
    "UNLOCK",
];
/// The shortest and the longest word that may be another method. With three letters a telegram has none of the commands
/// of TMCL; and the longest that is registered has 17.
const SHORTEST: usize = 3;
const LONGEST: usize = 24;
/// The beginning of the address in a request to a proxy.
const SCHEME: &[u8] = b"http:";
/// A record of a TLS handshake: its type, and the major version of its protocol. It is a telegram, too: the beginning
/// of command 3 (MST) to the module with address 22.
const TLS: [u8; 2] = [0x16, 3];

/// The caller at the other end of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Caller {
    /// The bytes that have come may be the beginning of either.
    Unknown,
    /// A host of modules, or a client of the control port.
    Host,
    /// A web browser, or something like it.
    Browser,
}

/// The first bytes of a connection, as long as it is not known who sends them.
#[derive(Debug, Default)]
pub(crate) struct Greeting {
    bytes: Vec<u8>,
    /// How many of them are held back no more.
    passed: usize,
}

impl Greeting {
    /// Takes the next bytes, and says what is known by now. If that is still [`Caller::Unknown`], they are held back.
    pub(crate) fn hear(&mut self, bytes: &[u8]) -> Caller {
        self.bytes.extend(bytes);
        caller(&self.bytes)
    }

    /// The bytes that are held back.
    pub(crate) fn held(&self) -> &[u8] {
        self.bytes.get(self.passed..).unwrap_or_default()
    }

    /// Gives the bytes that are held back. They go on to count as the beginning of the connection.
    pub(crate) fn release(&mut self) -> Vec<u8> {
        let held = self.held().to_vec();
        self.passed = self.bytes.len();
        held
    }
}

/// Tells who begins with these bytes. A telegram that begins with such a word has a letter, from 65 on, or `-` (45) for
/// its command. That is a user function at best, for an axis that no module has. So no check sum makes a host of it:
/// that of a request is up to the page.
fn caller(bytes: &[u8]) -> Caller {
    if TLS.starts_with(bytes) || bytes.starts_with(&TLS) {
        return match bytes.first_chunk::<TELEGRAM>() {
            None => Caller::Unknown,
            Some(telegram) if binary::decode(telegram).intact => Caller::Host,
            Some(_) => Caller::Browser,
        };
    }
    let is_of_word = |byte: &u8| byte.is_ascii_alphabetic() || *byte == b'-';
    let (word, rest) = bytes.split_at(bytes.iter().take_while(|byte| is_of_word(byte)).count());
    match rest {
        [] => match word.first_chunk::<TELEGRAM>() {
            Some(telegram) if binary::decode(telegram).intact => Caller::Host,
            _ if word.len() > LONGEST => Caller::Host,
            _ => Caller::Unknown,
        },
        [b' ', ..] if METHODS.iter().any(|method| method.as_bytes() == word) => Caller::Browser,
        [b' ', target @ ..] if word.len() >= SHORTEST => addressee(target),
        _ => Caller::Host,
    }
}

/// Tells who says this behind a word and a blank: a request of HTTP goes on with a path, `*`, or an address.
fn addressee(target: &[u8]) -> Caller {
    let begun = target.get(..SCHEME.len().min(target.len())).unwrap_or_default();
    match target {
        [b'/' | b'*', ..] => Caller::Browser,
        _ if begun.eq_ignore_ascii_case(SCHEME) => Caller::Browser,
        _ if SCHEME.get(..begun.len()).is_some_and(|scheme| begun.eq_ignore_ascii_case(scheme)) => Caller::Unknown,
        _ => Caller::Host,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tmcm::tmcl::Command;

    /// The caller as far as it is known after each of the bytes.
    fn known(bytes: &[u8]) -> Vec<Caller> {
        let mut greeting = Greeting::default();
        bytes.iter().map(|byte| greeting.hear(&[*byte])).collect()
    }

    #[test]
    fn a_browser_is_known_by_its_method_and_the_blank() {
        for method in METHODS {
            let known = known(format!("{method} / HTTP/1.1").as_bytes());
            let (before, after) = known.split_at(method.len());
            assert!(before.iter().all(|caller| *caller == Caller::Unknown), "{method}: {before:?}");
            assert_eq!(after[0], Caller::Browser, "{method}");
        }
        let mut whole = Greeting::default();
        assert_eq!(whole.hear(b"POST /x HTTP/1.1\r\n"), Caller::Browser);
    }

    /// Of methods that few know, and of those that somebody has made up.
    #[test]
    fn other_methods_are_known_by_what_follows_them() {
        for word in ["SEARCH", "M-SEARCH", "post", "Get", "UPDATEREDIRECTREF", "AROR"] {
            for target in ["/", "*", "http:", "HTTP:"] {
                let known = known(format!("{word} {target}").as_bytes());
                let (last, before) = known.split_last().unwrap();
                assert_eq!(*last, Caller::Browser, "{word} {target}: {known:?}");
                assert!(before.iter().all(|caller| *caller == Caller::Unknown), "{word} {target}: {known:?}");
            }
        }
        // A word without end is none, nor is one that a telegram may begin with.
        assert_eq!(known(&[b'x'; 25])[24], Caller::Host);
        assert_eq!(known(b"GO /x")[2], Caller::Host);
    }

    #[test]
    fn a_browser_is_known_by_the_hello_of_tls() {
        let hello = [0x16, 3, 1, 2, 0, 1, 0, 1, 0xFC];
        let known = known(&hello);
        assert!(known[..8].iter().all(|caller| *caller == Caller::Unknown) && known[8] == Caller::Browser, "{known:?}");
        let stop = binary::encode_command(22, Command::new(3, 0, 0, 0));
        assert_eq!((stop[0], stop[1]), (0x16, 3));
        assert_eq!(Greeting::default().hear(&stop), Caller::Host);
    }

    /// No complete telegram with a valid check sum waits, and no line.
    #[test]
    fn hosts_are_known_by_the_end_of_their_first_telegram_or_line() {
        for address in 0..=255 {
            for opcode in 0..=255 {
                let telegram = binary::encode_command(address, Command::new(opcode, 0x54, 0x53, 0x5443_4821));
                let known = known(&telegram);
                assert_ne!(known[8], Caller::Unknown, "{telegram:X?}");
                // TMCL has commands below 65, and from 128 on.
                let is_known = !(65..128).contains(&opcode);
                assert!(!is_known || known[8] == Caller::Host, "{telegram:X?}");
            }
        }
        for method in METHODS.iter().filter_map(|method| method.as_bytes().first_chunk::<TELEGRAM>()) {
            assert!(!binary::decode(method).intact, "{method:?}");
        }
        for line in [
            "C\r",
            "S8\r",
            "O\r",
            "P\r",
            "OPTIONS\r",
            "GET\n",
            "GETS 1",
            "AGAP 1",
            "AMVP ABS",
            "state\n",
            "press home",
            "\r",
            " ",
        ] {
            assert_eq!(known(line.as_bytes()).last(), Some(&Caller::Host), "{line:?}");
        }
    }

    #[test]
    fn what_has_been_given_still_counts() {
        let mut greeting = Greeting::default();
        greeting.hear(b"PO");
        assert_eq!((greeting.release(), greeting.held()), (b"PO".to_vec(), &b""[..]));
        assert_eq!(greeting.hear(b"S"), Caller::Unknown);
        assert_eq!(greeting.held(), b"S");
        assert_eq!(greeting.hear(b"T "), Caller::Browser);
    }
}
