//! Help for words that the deck does not know.

/// The known word that was probably meant.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let score = |candidate: &str| {
        let (a, b) = (word.to_lowercase(), candidate.to_lowercase());
        if a == b { 1.0 } else { strsim::jaro_winkler(&a, &b).max(strsim::normalized_damerau_levenshtein(&a, &b)) }
    };
    let best = known.into_iter().map(|k| (score(k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(score, _)| *score > 0.72).map(|(_, k)| k)
}
