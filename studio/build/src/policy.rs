//! The content security policy of the page, which says what it may do in a browser: run and read what comes from this
//! server, and nothing else. The page says so itself, for servers that do not.

/// The policy that stands in the page.
pub const PAGE: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; \
    img-src 'self' data:; connect-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'";

/// The place in the page where the policy comes to stand.
const PLACE: &str = "{policy}";

/// The policy as a header of an answer, the only place where browsers take from a page that no other frames it.
pub fn header() -> String {
    format!("{PAGE}; frame-ancestors 'none'")
}

/// The text of the page with the policy in its place. The error is one sentence.
pub fn place(page: &str) -> Result<String, String> {
    match page.matches(PLACE).count() {
        1 => Ok(page.replace(PLACE, PAGE)),
        count => Err(format!("{PLACE}, where the policy of the page goes, must stand there once, not {count} times")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_policy_stands_in_its_place() {
        let page = place("<meta content=\"{policy}\">").unwrap();
        assert!(page.starts_with("<meta content=\"default-src 'none'; script-src 'self' "), "{page}");
        assert!(page.ends_with("form-action 'none'\">"), "{page}");
    }

    #[test]
    fn a_page_without_one_place_is_refused() {
        assert!(place("<html>").unwrap_err().contains("not 0 times"));
        assert!(place("{policy} {policy}").unwrap_err().contains("not 2 times"));
    }
}
