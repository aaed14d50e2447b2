//! Axes of a chart.

use super::svg::{Anchor, Svg};

/// One axis: its range, and whether it is logarithmic.
#[derive(Clone, Copy)]
pub struct Scale {
    pub low: f64,
    pub high: f64,
    pub logarithmic: bool,
}

impl Scale {
    /// From zero to a round number that is not below `high`.
    pub fn from_zero(high: f64) -> Self {
        let step = round_step(high);
        Self {
            low: 0.0,
            high: step * (high / step).ceil().max(1.0),
            logarithmic: false,
        }
    }

    /// Where a value is, from 0 to 1 along the axis.
    fn share(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value.max(self.low) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    fn ticks(&self) -> Vec<f64> {
        if self.logarithmic {
            let decades = (self.high / self.low).log10().round() as i32;
            return (0..=decades)
                .map(|decade| self.low * 10f64.powi(decade))
                .collect();
        }
        let step = round_step(self.high - self.low);
        let count = ((self.high - self.low) / step + 1e-9).floor() as usize;
        (0..=count)
            .map(|tick| self.low + step * tick as f64)
            .collect()
    }
}

/// A step of 1, 2 or 5 times a power of ten that cuts a range into about four.
fn round_step(range: f64) -> f64 {
    let rough = (range / 4.0).max(1e-9);
    let decade = 10f64.powf(rough.log10().floor());
    let multiple = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|m| m * decade * 1.2 >= rough);
    decade * multiple.unwrap_or(10.0)
}

/// A chart's rectangle and its axes.
pub struct Axes {
    /// Upper left corner, px.
    pub at: [f64; 2],
    /// Width and height, px.
    pub size: [f64; 2],
    pub x: Scale,
    pub y: Scale,
}

impl Axes {
    /// Place of a value, px.
    pub fn place(&self, x: f64, y: f64) -> [f64; 2] {
        [
            self.at[0] + self.size[0] * self.x.share(x),
            self.at[1] + self.size[1] * (1.0 - self.y.share(y)),
        ]
    }

    /// Draws grid, frame, numbers and names; the numbers of the y axis only if it has a name.
    pub fn draw(&self, svg: &mut Svg, x_name: &str, y_name: Option<&str>) {
        let [left, top] = self.at;
        let (right, bottom) = (left + self.size[0], top + self.size[1]);
        for tick in self.x.ticks() {
            let [x, _] = self.place(tick, self.y.low);
            svg.line([x, top], [x, bottom], "grid");
            svg.text([x, bottom + 15.0], Anchor::Middle, "small", &number(tick));
        }
        for tick in self.y.ticks() {
            let [_, y] = self.place(self.x.low, tick);
            svg.line([left, y], [right, y], "grid");
            if y_name.is_some() {
                svg.text([left - 6.0, y + 4.0], Anchor::End, "small", &number(tick));
            }
        }
        svg.add(format_args!(
            r#"<rect class="frame" x="{left:.1}" y="{top:.1}" width="{:.1}" height="{:.1}"/>"#,
            self.size[0], self.size[1]
        ));
        svg.text(
            [0.5 * (left + right), bottom + 34.0],
            Anchor::Middle,
            "label",
            x_name,
        );
        if let Some(name) = y_name {
            let (x, y) = (left - 44.0, 0.5 * (top + bottom));
            svg.add(format_args!(r#"<g transform="rotate(-90 {x:.1} {y:.1})">"#));
            svg.text([x, y], Anchor::Middle, "label", name);
            svg.add("</g>");
        }
    }
}

/// A tick's number, without needless digits.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within_the_range() {
        let ticks = |high: f64| Scale::from_zero(high).ticks();
        assert_eq!(ticks(8.0), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(ticks(71.0), [0.0, 20.0, 40.0, 60.0, 80.0]);
        let log = Scale {
            low: 0.1,
            high: 1000.0,
            logarithmic: true,
        };
        let told: Vec<_> = log.ticks().into_iter().map(number).collect();
        assert_eq!(told, ["0.1", "1", "10", "100", "1000"]);
    }

    #[test]
    fn a_logarithmic_axis_gives_each_decade_the_same_length() {
        let log = Scale {
            low: 0.1,
            high: 1000.0,
            logarithmic: true,
        };
        assert!((log.share(1.0) - 0.25).abs() < 1e-12);
        assert!((log.share(100.0) - 0.75).abs() < 1e-12);
        assert_eq!(log.share(0.0), 0.0);
    }
}
