//! Text in a message: UTF-8, eight bytes to a word, lowest byte first, zero after the end.
//!
//! A message holds integers and floats only; a sentence for a person travels as words. What does not fit is cut at a
//! character; whatever a writer left there, a reader gets text of one line.

/// The words of a text.
#[must_use]
pub fn words<const N: usize>(text: &str) -> [u64; N] {
    let mut end = text.len().min(8 * N);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let mut words = [0; N];
    for (index, byte) in text.as_bytes()[..end].iter().enumerate() {
        words[index / 8] |= u64::from(*byte) << (8 * (index % 8));
    }
    words
}

/// The text of these words.
#[must_use]
pub fn of_words(words: &[u64]) -> String {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes());
    let text: Vec<u8> = bytes.take_while(|byte| *byte != 0).collect();
    String::from_utf8_lossy(&text).chars().filter(|c| !c.is_control()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORDS: usize = 4;

    #[test]
    fn a_text_comes_back_whole_or_cut_at_a_character() {
        for text in ["", "bdf2 x 1: S = 3.2", "µ"] {
            assert_eq!(of_words(&words::<WORDS>(text)), text);
        }
        let long = format!("{}µµ", "x".repeat(8 * WORDS - 1));
        assert_eq!(of_words(&words::<WORDS>(&long)), "x".repeat(8 * WORDS - 1));
        assert_eq!(of_words(&words::<0>("no room")), "");
    }

    #[test]
    fn arbitrary_words_give_a_line_without_control_characters() {
        let text = of_words(&[0xFF0A_41FF_0A41_FFFF; WORDS]);
        assert!(text.contains('A') && text.chars().all(|c| !c.is_control()), "{text:?}");
    }
}
