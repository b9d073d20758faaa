//! Cuts Rust sources into tokens.

/// The words and single characters of a source, without comments and without the contents of string and character
/// literals.
pub(crate) fn tokens(source: &str) -> Vec<&str> {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let mut tokens = Vec::new();
    let mut rest = source;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            _ if first.is_whitespace() => first.len_utf8(),
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => block_comment(rest),
            '"' => 1 + quoted(&rest[1..], '"'),
            // A quote that is not the beginning of a lifetime begins a character literal.
            '\'' if rest[1..].starts_with('\\') || rest.chars().nth(2) == Some('\'') => 1 + quoted(&rest[1..], '\''),
            _ => match raw_string(rest) {
                Some(length) => length,
                None => {
                    let length = if word(first) { rest.find(|c| !word(c)) } else { Some(first.len_utf8()) };
                    let length = length.unwrap_or(rest.len());
                    tokens.push(&rest[..length]);
                    length
                }
            },
        };
        rest = &rest[length..];
    }
    tokens
}

/// Length of a block comment, with the block comments nested in it.
fn block_comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    loop {
        let rest = &text[at..];
        let step = match rest.as_bytes() {
            [] => return at,
            [b'/', b'*', ..] => (1, 2),
            [b'*', b'/', ..] => (-1, 2),
            _ => (0, rest.chars().next().map_or(0, char::len_utf8)),
        };
        depth += step.0;
        at += step.1;
        if depth == 0 {
            return at;
        }
    }
}

/// Length of a literal up to and including its closing quote.
fn quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return at + c.len_utf8(),
            _ => {}
        }
    }
    text.len()
}

/// Length of the raw string literal (`r"`, `br#"` ...) at the start of the text; `None` if there is none.
fn raw_string(text: &str) -> Option<usize> {
    let body = text.strip_prefix("br").or_else(|| text.strip_prefix('r'))?;
    let fence = body.trim_start_matches('#');
    let marks = body.len() - fence.len();
    let inner = fence.strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(marks));
    let start = text.len() - inner.len();
    Some(inner.find(&end).map_or(text.len(), |at| start + at + end.len()))
}
