//! The report as one HTML file: words, inline SVG, tables. No script, no style sheet, font or picture from elsewhere.
//!
//! Numbers are shortened to four significant digits for the eye; the JSON and CSV files hold them whole.

use super::document::{Report, effort_name};
use super::section::{Row, Section};
use haptic_server::report::svg::escape;
use serde_json::Value;
use std::fmt::Write as _;

const STYLE: &str = "
:root { color-scheme: light; }
body { font: 16px/1.55 Georgia, 'Times New Roman', serif; color: #1c1c1c; background: #fff; margin: 0 auto; max-width: 1180px; padding: 2rem 1.5rem 5rem; }
h1, h2, nav, table, figcaption, .facts, .notice { font-family: system-ui, 'Segoe UI', Helvetica, Arial, sans-serif; }
h1 { font-size: 1.9rem; margin: 0 0 .4rem; } h2 { font-size: 1.35rem; margin: 3rem 0 .6rem; border-bottom: 2px solid #0072b2; padding-bottom: .2rem; }
p { max-width: 78ch; } nav ol { columns: 2; padding-left: 1.4rem; } nav a { color: #00558a; }
.facts { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1rem; font-size: .9rem; margin: 1rem 0; } .facts dt { color: #555; } .facts dd { margin: 0; overflow-wrap: anywhere; }
.notice { border-left: 5px solid #d55e00; background: #fff4ec; padding: .6rem 1rem; margin: 1rem 0; }
.good { border-left-color: #009e73; background: #eefaf5; }
figure { margin: 1.4rem 0; } figure svg { max-width: 100%; height: auto; } figcaption { font-size: .9rem; color: #444; max-width: 85ch; }
.table { max-height: 34rem; overflow: auto; border: 1px solid #ddd; margin: 1rem 0; }
table { border-collapse: collapse; font-size: .82rem; } th, td { padding: .22rem .6rem; text-align: right; border-bottom: 1px solid #eee; white-space: nowrap; }
td.text { text-align: left; white-space: normal; min-width: 4rem; max-width: 44rem; } th { position: sticky; top: 0; background: #f3f6f8; text-align: left; vertical-align: bottom; }
tr.bad td { background: #fdeee6; }
@media print { body { max-width: none; padding: 0; font-size: 10.5pt; } .table { max-height: none; overflow: visible; border: 0; } th { position: static; } table { font-size: 7pt; } h2 { break-before: page; } figure, tr { break-inside: avoid; } nav ol { columns: 1; } }
";

/// The whole page.
pub(super) fn html(report: &Report) -> String {
    let mut page = String::new();
    let _ = write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Accuracy report</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>Accuracy report</h1>\n"
    );
    page.push_str("<dl class=\"facts\">\n");
    let effort = ("effort", effort_name(report.effort).to_owned());
    for (name, value) in report.head.facts.iter().chain([&effort]) {
        let _ = writeln!(page, "<dt>{}</dt><dd>{}</dd>", escape(name), escape(value));
    }
    page.push_str("</dl>\n");
    notices(&mut page, report);
    page.push_str("<nav aria-label=\"Contents\"><ol>\n");
    for section in report.all_sections() {
        let _ = writeln!(page, "<li><a href=\"#{}\">{}</a></li>", escape(section.key), escape(&section.title));
    }
    page.push_str("</ol></nav>\n");
    for section in report.all_sections() {
        write_section(&mut page, &section);
    }
    page.push_str("</body>\n</html>\n");
    page
}

fn notices(page: &mut String, report: &Report) {
    if let Some(key) = report.stopped_in {
        let _ = writeln!(
            page,
            "<p class=\"notice\">This report was stopped while measuring “{}”: that part holds what was \
             measured until then.</p>",
            escape(key)
        );
    }
    if !report.not_measured.is_empty() {
        let list = report.not_measured.iter().map(|k| escape(k)).collect::<Vec<_>>().join(", ");
        let _ = writeln!(page, "<p class=\"notice\">Partial report. Not measured: {list}.</p>");
    }
    match &report.worse {
        Some(worse) if worse.is_empty() => {
            page.push_str("<p class=\"notice good\">Nothing got worse than in the stored report.</p>\n");
        }
        Some(worse) => {
            let _ = writeln!(
                page,
                "<div class=\"notice\"><p>{} values got worse than in the stored report:</p><ul>",
                worse.len()
            );
            for entry in worse {
                let _ = writeln!(page, "<li>{}</li>", escape(&entry.to_string()));
            }
            page.push_str("</ul></div>\n");
        }
        None => {}
    }
}

fn write_section(page: &mut String, section: &Section) {
    let _ = writeln!(page, "<section id=\"{}\">\n<h2>{}</h2>", escape(section.key), escape(&section.title));
    for words in &section.words {
        let _ = writeln!(page, "<p>{}</p>", escape(words));
    }
    for figure in &section.figures {
        let _ = writeln!(
            page,
            "<figure id=\"figure-{}\">\n{}<figcaption>{}</figcaption>\n</figure>",
            escape(&figure.name),
            figure.svg,
            escape(&figure.caption)
        );
    }
    if let Some(first) = section.rows.first() {
        page.push_str("<div class=\"table\" tabindex=\"0\"><table>\n<thead><tr>");
        for (name, _) in first {
            let _ = write!(page, "<th>{}</th>", escape(&name.replace('_', " ")));
        }
        page.push_str("</tr></thead>\n<tbody>\n");
        for row in &section.rows {
            let bad = row.iter().any(|(name, value)| is_bad(name, value));
            page.push_str(if bad { "<tr class=\"bad\">" } else { "<tr>" });
            for (name, value) in row {
                let class = if value.is_string() { " class=\"text\"" } else { "" };
                let _ = write!(
                    page,
                    "<td{class}>{}</td>",
                    escape(&unresolved(row, name, value).unwrap_or_else(|| for_the_eye(value)))
                );
            }
            page.push_str("</tr>\n");
        }
        page.push_str("</tbody></table></div>\n");
    }
    page.push_str("</section>\n");
}

/// Rows that a reader must not overlook: failed, wrong, not agreeing.
fn is_bad(name: &str, value: &Value) -> bool {
    match name {
        "pass" | "agree" => *value == Value::Bool(false),
        "outcome" => value == "wrong",
        _ => false,
    }
}

/// `< least` for an error below what its row says the references resolve.
fn unresolved(row: &Row, name: &str, value: &Value) -> Option<String> {
    let (_, least) = row.iter().find(|(column, _)| *column == "resolved_from")?;
    let (least, error) = (least.as_f64()?, value.as_f64()?);
    (matches!(name, "position_error" | "force_error") && error < least).then(|| format!("< {least:.0e}"))
}

/// Four significant digits; small and large numbers as powers of ten.
fn for_the_eye(value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(n) if n.is_i64() || n.is_u64() => n.to_string(),
        Value::Number(n) => shortened(n.as_f64().unwrap_or(f64::NAN)),
        other => other.to_string(),
    }
}

fn shortened(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&size) {
        let digits = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.2e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn an_error_below_the_references_is_written_as_such() {
        let row: Row = vec![
            ("position_error", json!(5e-9)),
            ("force_error", json!(9e-9)),
            ("energy_drift", json!(1e-12)),
            ("resolved_from", json!(8e-9)),
        ];
        let written: Vec<Option<String>> = row.iter().map(|(name, value)| unresolved(&row, name, value)).collect();
        assert_eq!(written, [Some("< 8e-9".to_owned()), None, None, None]);
    }

    #[test]
    fn numbers_keep_four_digits() {
        for (value, text) in
            [(0.05, "0.05"), (1234.56, "1235"), (1.5e-3, "0.0015"), (2.345e-9, "2.35e-9"), (-1.0, "-1")]
        {
            assert_eq!(shortened(value), text);
        }
    }
}
