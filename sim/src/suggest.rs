//! Suggestions for misspelt names: "did you mean 'Speed'?"

/// Longest word, in characters, for which a suggestion is made; comparing longer ones would take too long.
const LONGEST: usize = 64;

/// The end of a message about an unknown word: the name among `names` that the word resembles, or an empty string.
pub fn suggestion<'a>(word: &str, names: impl Iterator<Item = &'a str>) -> String {
    nearest(word, names).map_or_else(String::new, |name| format!("; did you mean '{name}'?"))
}

/// The name closest to a word. One letter in four may be wrong; if no name is that close, the word may be an
/// abbreviation.
pub fn nearest<'a>(word: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let letters = folded(word);
    if letters.len() > LONGEST {
        return None;
    }
    let ranked = names.filter(|name| name.len() <= LONGEST).filter_map(|name| {
        let candidate = folded(name);
        let most = (letters.len() / 4).max(1);
        // The distance is at least the difference of the lengths, which is quicker to find.
        let comparable = letters.len().abs_diff(candidate.len()) <= most;
        let distance = comparable.then(|| distance(&letters, &candidate));
        let close = distance.filter(|distance| *distance <= most && *distance < letters.len());
        close
            .map(|distance| (0, distance))
            .or_else(|| abbreviates(&letters, &candidate).then_some((1, candidate.len())))
            .map(|rank| (rank, name))
    });
    ranked.min().map(|(_, name)| name)
}

fn folded(word: &str) -> Vec<char> {
    word.to_lowercase().chars().collect()
}

/// Number of letters that must be changed, inserted or removed to turn one word into the other.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = i;
        let mut left = i + 1;
        for (y, above) in b.iter().zip(row.iter_mut().skip(1)) {
            let changed = diagonal + usize::from(x != y);
            diagonal = *above;
            left = changed.min(diagonal + 1).min(left + 1);
            *above = left;
        }
        if let Some(first) = row.first_mut() {
            *first = i + 1;
        }
    }
    row.last().copied().unwrap_or_default()
}

/// True if the name contains all letters of the word in their order, and begins with the same letter.
fn abbreviates(word: &[char], name: &[char]) -> bool {
    let mut letters = name.iter();
    word.len() >= 4 && word.first() == name.first() && word.iter().all(|letter| letters.any(|other| other == letter))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typing_errors_and_abbreviations() {
        let names = ["APMaxPositioningSpeed", "APMinSpeed", "APMaxAcceleration", "Loop", "Timer0Irq", "X"];
        let nearest = |word| nearest(word, names.into_iter());
        assert_eq!(nearest("Lop"), Some("Loop"));
        assert_eq!(nearest("lopp"), Some("Loop"));
        assert_eq!(nearest("APMaxAceleration"), Some("APMaxAcceleration"));
        assert_eq!(nearest("APMaxSped"), Some("APMaxPositioningSpeed"));
        assert_eq!(nearest("Timr1Irq"), Some("Timer0Irq"));
        assert_eq!(nearest("Y"), None);
        assert_eq!(nearest("Motor0"), None);
        assert_eq!(nearest(&"Loop".repeat(100)), None);
    }

    #[test]
    fn distances() {
        let distance = |a: &str, b: &str| distance(&folded(a), &folded(b));
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("abc", ""), 3);
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("loop", "LOOP"), 0);
    }
}
