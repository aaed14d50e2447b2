//! A panel of a plot: its rectangle and axes.

use crate::picture::svg::{Anchor, Svg};

/// An axis.
#[derive(Clone, Copy)]
pub enum Scale {
    /// From the first value to the second, in proportion.
    Linear(f64, f64),
    /// From the first value to the second, each decade as long as the others.
    Decades(f64, f64),
}

impl Scale {
    /// Where a value is along the axis: 0 to 1, also for values beyond its ends.
    fn share(self, value: f64) -> f64 {
        let share = match self {
            Self::Linear(low, high) => (value - low) / (high - low),
            Self::Decades(low, high) => (value.max(low) / low).ln() / (high / low).ln(),
        };
        share.clamp(0.0, 1.0)
    }
}

/// The axis of position errors, mm.
pub const ERROR: Scale = Scale::Decades(0.003, 5000.0);
/// Where errors are shown that are infinite for want of an estimate, mm.
const NO_ESTIMATE: f64 = 3000.0;
/// The names along [`ERROR`].
pub const ERROR_TICKS: [(f64, &str); 7] = [
    (0.01, "0.01"),
    (0.1, "0.1"),
    (1.0, "1"),
    (10.0, "10"),
    (100.0, "100"),
    (1000.0, "1000"),
    (NO_ESTIMATE, "none"),
];

/// Where along [`ERROR`] an error in metres is shown.
pub fn shown_error(metres: f64) -> f64 {
    (1e3 * metres).min(NO_ESTIMATE)
}

/// A rectangle with two axes, px.
pub struct Panel {
    pub at: [f64; 2],
    pub size: [f64; 2],
    pub x: Scale,
    pub y: Scale,
}

impl Panel {
    /// Place of a pair of values, px.
    pub fn place(&self, x: f64, y: f64) -> [f64; 2] {
        [
            self.at[0] + self.size[0] * self.x.share(x),
            self.at[1] + self.size[1] * (1.0 - self.y.share(y)),
        ]
    }

    /// Draws the grid's lines across at values of y, with their names, and what the axis is.
    pub fn draw_y(&self, svg: &mut Svg, ticks: &[(f64, &str)], name: &str) {
        let [left, top] = self.at;
        for (value, tick) in ticks {
            let [_, y] = self.place(0.0, *value);
            svg.line([left, y], [left + self.size[0], y], "grid");
            svg.text([left - 8.0, y + 4.0], Anchor::End, "small", tick);
        }
        let (x, y) = (left - 58.0, top + 0.5 * self.size[1]);
        svg.add(format_args!(r#"<g transform="rotate(-90 {x:.1} {y:.1})">"#));
        svg.text([x, y], Anchor::Middle, "label", name);
        svg.add("</g>");
    }

    /// Draws names below values of x, what the axis is, and the frame.
    pub fn draw_x(&self, svg: &mut Svg, ticks: &[(f64, String)], name: &str) {
        let [left, top] = self.at;
        let bottom = top + self.size[1];
        for (value, tick) in ticks {
            let [x, _] = self.place(*value, 0.0);
            svg.text([x, bottom + 17.0], Anchor::Middle, "label", tick);
        }
        let middle = left + 0.5 * self.size[0];
        svg.text([middle, bottom + 36.0], Anchor::Middle, "label", name);
        svg.add(format_args!(
            r#"<rect class="frame" x="{left:.1}" y="{top:.1}" width="{:.1}" height="{:.1}"/>"#,
            self.size[0], self.size[1]
        ));
    }

    /// Draws a dashed line across at a value of y, and what it means at its right end.
    pub fn mark(&self, svg: &mut Svg, value: f64, meaning: &str) {
        let [_, y] = self.place(0.0, value);
        let right = self.at[0] + self.size[0];
        svg.line([self.at[0], y], [right, y], "mark");
        svg.text([right - 6.0, y - 5.0], Anchor::End, "small", meaning);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_beyond_an_axis_stay_at_its_end() {
        let panel = Panel {
            at: [10.0, 20.0],
            size: [100.0, 200.0],
            x: Scale::Linear(0.0, 2.0),
            y: Scale::Decades(0.01, 100.0),
        };
        assert_eq!(panel.place(1.0, 1.0), [60.0, 120.0]);
        assert_eq!(panel.place(9.0, 1e9), [110.0, 20.0]);
        assert_eq!(panel.place(-9.0, 0.0), [10.0, 220.0]);
        assert_eq!(panel.place(0.0, f64::INFINITY), [10.0, 20.0]);
    }
}
