//! Least squares with penalties (ridge regression, Hoerl & Kennard 1970).

/// The coefficients b that minimize `sum (y - x b)^2 + sum penalty b^2`. Each row of `rows` is an x and its y.
///
/// Positive penalties make the solution unique, also with fewer rows than coefficients.
pub fn ridge(rows: &[(Vec<f64>, f64)], penalties: &[f64]) -> Vec<f64> {
    let n = penalties.len();
    let mut matrix = vec![vec![0.0; n]; n];
    let mut right = vec![0.0; n];
    for (i, penalty) in penalties.iter().enumerate() {
        matrix[i][i] = *penalty;
    }
    for (x, y) in rows {
        for i in (0..n).filter(|&i| x[i] != 0.0) {
            right[i] += x[i] * y;
            for j in 0..=i {
                matrix[i][j] += x[i] * x[j];
            }
        }
    }
    solve(matrix, right)
}

/// Solves A b = r by Cholesky's factors. A is symmetric and positive; its lower half is read.
fn solve(mut a: Vec<Vec<f64>>, mut r: Vec<f64>) -> Vec<f64> {
    let n = r.len();
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| a[i][k] * a[j][k]).sum();
            a[i][j] = if i == j { (a[i][i] - sum).max(f64::MIN_POSITIVE).sqrt() } else { (a[i][j] - sum) / a[j][j] };
        }
    }
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| a[i][k] * r[k]).sum();
        r[i] = (r[i] - sum) / a[i][i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| a[k][i] * r[k]).sum();
        r[i] = (r[i] - sum) / a[i][i];
    }
    r
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found() {
        let rows: Vec<_> = (0..5).map(|x| (vec![1.0, f64::from(x)], 3.0 - 0.5 * f64::from(x))).collect();
        let found = ridge(&rows, &[1e-9, 1e-9]);
        assert!((found[0] - 3.0).abs() < 1e-6 && (found[1] + 0.5).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn what_was_not_measured_has_no_effect() {
        // By hand: b minimizes (4 - b)^2 + b^2, so it is 2; nothing is known of the other.
        let found = ridge(&[(vec![1.0, 0.0], 4.0)], &[1.0, 1.0]);
        assert!((found[0] - 2.0).abs() < 1e-12 && found[1] == 0.0, "{found:?}");
        assert_eq!(ridge(&[], &[1.0, 1.0]), [0.0, 0.0]);
    }
}
