//! SVG as text.

use std::fmt::{Display, Write};

/// An SVG that grows from back to front.
#[derive(Default)]
pub struct Svg {
    text: String,
}

/// Where a text is held.
#[derive(Clone, Copy)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

impl Svg {
    /// Adds an element as it is written.
    pub fn add(&mut self, element: impl Display) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.text, "{element}");
    }

    /// Adds a line of text of some class.
    pub fn text(&mut self, [x, y]: [f64; 2], anchor: Anchor, class: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escape(text);
        self.add(format_args!(
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" class="{class}">{text}</text>"#
        ));
    }

    /// Adds a straight line of some class.
    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], class: &str) {
        self.add(format_args!(
            r#"<path class="{class}" d="M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}"/>"#
        ));
    }

    /// Adds a line through points, of some class; it breaks where there is none.
    pub fn polyline(&mut self, points: impl Iterator<Item = Option<[f64; 2]>>, class: &str) {
        let mut path = String::new();
        let mut pen_down = false;
        for point in points {
            if let Some([x, y]) = point {
                let step = if pen_down { 'L' } else { 'M' };
                let _ = write!(path, "{step}{x:.1} {y:.1}");
            }
            pen_down = point.is_some();
        }
        if !path.is_empty() {
            self.add(format_args!(r#"<path class="{class}" d="{path}"/>"#));
        }
    }

    /// Adds dots of one diameter and colour; many in little text, as points of a line with round ends.
    pub fn dots(&mut self, points: impl Iterator<Item = [f64; 2]>, diameter: f64, colour: &str) {
        let mut path = String::new();
        for [x, y] in points {
            let _ = write!(path, "M{x:.1} {y:.1}h.1");
        }
        if !path.is_empty() {
            self.add(format_args!(
                r#"<path class="dots" stroke="{colour}" stroke-width="{diameter}" d="{path}"/>"#
            ));
        }
    }

    /// The whole picture, `width` × `height` pixels, with a style sheet.
    pub fn finish(self, width: f64, height: f64, style: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n<style>{style}</style>\n{}</svg>\n",
            self.text
        )
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
