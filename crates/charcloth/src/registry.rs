//! Tables of what can be chosen by name. Help, lists and tests walk them.

use crate::error::Error;

/// One choice: its name in scenes and on the command line, one line about it, and the thing itself.
#[derive(Debug)]
pub struct Entry<T: 'static> {
    /// Name, as users write it.
    pub name: &'static str,
    /// One line about it.
    pub about: &'static str,
    /// What it builds or does.
    pub item: T,
}

/// Finds a row by name; the error names the key, the choices and the nearest of them.
pub fn find<T>(table: &'static [Entry<T>], name: &str, key: &str) -> Result<&'static Entry<T>, Error> {
    table.iter().find(|entry| entry.name == name).ok_or_else(|| {
        let names: Vec<_> = table.iter().map(|entry| entry.name).collect();
        let hint = match nearest(name, names.iter().copied()) {
            Some(near) => format!("did you mean \"{near}\"? There are: {}", names.join(", ")),
            None => format!("there are: {}", names.join(", ")),
        };
        Error::scene(key, format!("\"{name}\" is not known"), hint)
    })
}

/// The candidate nearest to a word by edit distance, if any is near.
pub fn nearest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let near_enough = (word.chars().count() / 3).max(2);
    candidates.map(|c| (edit_distance(word, c), c)).filter(|(d, _)| *d <= near_enough).min().map(|(_, c)| c)
}

/// Levenshtein distance of two words, a swap of neighbours counting as two.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found() {
        assert_eq!(nearest("grammmage", ["grammage", "gravity"].into_iter()), Some("grammage"));
        assert_eq!(nearest("zzz", ["grammage", "gravity"].into_iter()), None);
    }
}
