//! A small Rust scanner: enough to tell code from comments, literals and test items.
//!
//! Nothing here parses Rust; offsets and line breaks are kept, so that a finding can name its line.

/// Replaces comments, string and character literals by blanks.
pub(crate) fn blank_comments_and_literals(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = bytes.to_vec();
    let mut i = 0;
    while i < bytes.len() {
        let end = match bytes[i] {
            b'/' if bytes.get(i + 1) == Some(&b'/') => line_end(bytes, i),
            b'/' if bytes.get(i + 1) == Some(&b'*') => block_comment_end(bytes, i),
            b'"' => string_end(bytes, i),
            b'r' if starts_raw_string(bytes, i) => raw_string_end(bytes, i),
            b'\'' => char_end(bytes, i),
            _ => i,
        };
        for byte in &mut out[i..end] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
        i = end.max(i + 1);
    }
    String::from_utf8(out).unwrap_or_default()
}

fn line_end(bytes: &[u8], from: usize) -> usize {
    bytes[from..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |n| from + n)
}

fn block_comment_end(bytes: &[u8], from: usize) -> usize {
    let (mut depth, mut i) = (0, from);
    while i + 1 < bytes.len() {
        match (bytes[i], bytes[i + 1]) {
            (b'/', b'*') => (depth, i) = (depth + 1, i + 2),
            (b'*', b'/') => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            return i;
        }
    }
    bytes.len()
}

fn string_end(bytes: &[u8], from: usize) -> usize {
    let mut i = from + 1;
    while i < bytes.len() {
        match bytes[i] {
            b'\\' => i += 2,
            b'"' => return i + 1,
            _ => i += 1,
        }
    }
    bytes.len()
}

fn starts_raw_string(bytes: &[u8], at: usize) -> bool {
    let fresh = at == 0 || !is_word(bytes[at - 1]) || (bytes[at - 1] == b'b' && (at == 1 || !is_word(bytes[at - 2])));
    let hashes = bytes[at + 1..].iter().take_while(|b| **b == b'#').count();
    fresh && bytes.get(at + 1 + hashes) == Some(&b'"')
}

fn raw_string_end(bytes: &[u8], from: usize) -> usize {
    let hashes = bytes[from + 1..].iter().take_while(|b| **b == b'#').count();
    let mut i = from + 2 + hashes;
    while i < bytes.len() {
        if bytes[i] == b'"' && bytes[i + 1..].iter().take(hashes).filter(|b| **b == b'#').count() == hashes {
            return i + 1 + hashes;
        }
        i += 1;
    }
    bytes.len()
}

/// End of a character literal, or `from` when the quote begins a lifetime.
fn char_end(bytes: &[u8], from: usize) -> usize {
    if bytes.get(from + 1) == Some(&b'\\') {
        let close = bytes.get(from + 3..).unwrap_or_default().iter().position(|b| *b == b'\'');
        return close.map_or(bytes.len(), |n| from + 4 + n);
    }
    let text = bytes.get(from + 1..(from + 6).min(bytes.len())).unwrap_or_default();
    match text.iter().position(|b| *b == b'\'') {
        Some(n) if n > 0 && (n == 1 || text[0] >= 0x80) => from + n + 2,
        _ => from,
    }
}

/// Replaces every item under `#[cfg(test)]` by blanks. Takes code without comments and literals.
pub(crate) fn blank_test_items(code: &str) -> String {
    let mut out = code.as_bytes().to_vec();
    let mut from = 0;
    while let Some(found) = code[from..].find("#[cfg(test)]") {
        let start = from + found;
        let end = item_end(code, start + "#[cfg(test)]".len());
        for byte in &mut out[start..end] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
        from = end;
    }
    String::from_utf8(out).unwrap_or_default()
}

/// First `;` or closing brace that ends the item at `from`.
fn item_end(code: &str, from: usize) -> usize {
    let mut depth = 0_usize;
    for (i, byte) in code.bytes().enumerate().skip(from) {
        match byte {
            b'{' | b'(' | b'[' => depth += 1,
            b')' | b']' => depth = depth.saturating_sub(1),
            b'}' if depth <= 1 => return i + 1,
            b'}' => depth -= 1,
            b';' if depth == 0 => return i + 1,
            _ => {}
        }
    }
    code.len()
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// Offsets of `pattern` in `code` that do not begin or end within a longer word.
pub(crate) fn words<'a>(code: &'a str, pattern: &'a str) -> impl Iterator<Item = usize> + 'a {
    let bytes = code.as_bytes();
    let ends_in_word = pattern.bytes().last().is_some_and(is_word);
    let begins_with_word = pattern.bytes().next().is_some_and(is_word);
    code.match_indices(pattern).map(|(at, _)| at).filter(move |&at| {
        let before = at.checked_sub(1).is_some_and(|i| is_word(bytes[i]));
        let after = bytes.get(at + pattern.len()).is_some_and(|b| is_word(*b));
        !(begins_with_word && before || ends_in_word && after)
    })
}

/// The identifier at `offset`.
pub(crate) fn word_at(code: &str, offset: usize) -> &str {
    let rest = &code[offset..];
    &rest[..rest.bytes().position(|b| !is_word(b)).unwrap_or(rest.len())]
}

#[test]
fn comments_and_literals_are_blank_and_lifetimes_stay() {
    let code =
        "let a = \"Vec<\"; // Box\nlet b = r#\"vec!\"#; /* x /* y */ */ let c = 'é'; fn f<'a>(s: &'a str) { '\\'' }";
    let blank = blank_comments_and_literals(code);
    assert_eq!(blank.len(), code.len());
    for word in ["Vec<", "Box", "vec!", "x", "y", "é"] {
        assert!(!blank.contains(word), "{word} left in {blank}");
    }
    assert!(blank.contains("fn f<'a>(s: &'a str) {"), "{blank}");
}

#[test]
fn test_items_are_blank_and_the_rest_stays() {
    let code = "fn a() {}\n#[cfg(test)]\nmod tests { fn b() { {} } }\n#[cfg(test)]\nmod c;\nfn d() {}";
    let product = blank_test_items(code);
    assert!(product.contains("fn a()") && product.contains("fn d()"), "{product}");
    assert!(!product.contains("fn b()") && !product.contains("mod c"), "{product}");
}

#[test]
fn words_are_whole() {
    assert_eq!(words("unsafe_code unsafe { my_unsafe }", "unsafe").collect::<Vec<_>>(), [12]);
    assert_eq!(words("SmallVec<T> Vec<T>", "Vec<").collect::<Vec<_>>(), [12]);
}
