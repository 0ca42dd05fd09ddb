//! How evenly light is spread over points: mean, least, most and uniformity, as EN 12464-1 asks for them.
//!
//! ```text
//! U_0 = least / mean      illuminance uniformity of EN 12464-1        U_d = least / most      diversity
//! ```
//!
//! Points inside of solids are no places to measure light at: they are left out, and counted.
//!
//! Not handled: the margin at walls that the standard allows to leave out; which points a task area has.

/// How evenly a value is spread over points.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Uniformity {
    /// Points that count.
    pub count: usize,
    /// Points inside of solids, which do not.
    pub left_out: usize,
    /// Mean of the value.
    pub mean: f64,
    /// Its least value.
    pub least: f64,
    /// Its greatest value.
    pub most: f64,
    /// `least / mean`; 0 where all is dark.
    pub least_over_mean: f64,
    /// `least / most`; 0 where all is dark.
    pub least_over_most: f64,
}

impl Uniformity {
    /// Of the values at points, such as their illuminance, none where one is left out; all 0 where none counts.
    pub fn of(points: impl IntoIterator<Item = Option<f64>>) -> Uniformity {
        let all: Vec<Option<f64>> = points.into_iter().collect();
        let kept: Vec<f64> = all.iter().flatten().copied().collect();
        let left_out = all.len() - kept.len();
        if kept.is_empty() {
            return Uniformity { left_out, ..Uniformity::default() };
        }
        let mean = kept.iter().sum::<f64>() / kept.len() as f64;
        let least = kept.iter().copied().fold(f64::INFINITY, f64::min);
        let most = kept.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let over = |all: f64| if all > 0.0 { least / all } else { 0.0 };
        let (least_over_mean, least_over_most) = (over(mean), over(most));
        Uniformity { count: kept.len(), left_out, mean, least, most, least_over_mean, least_over_most }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_inside_of_solids_do_not_count() {
        let found = Uniformity::of([Some(2.0), None, Some(6.0)]);
        assert_eq!((found.count, found.left_out, found.mean, found.least, found.most), (2, 1, 4.0, 2.0, 6.0));
        assert_eq!((found.least_over_mean, found.least_over_most), (0.5, 1.0 / 3.0));
        assert_eq!(Uniformity::of([None]).count, 0);
        assert_eq!(Uniformity::of([Some(0.0)]).least_over_mean, 0.0);
    }
}
