//! relMSE of `albedo * indirect` over block means: `blocks IMAGE.exr TRUTH.exr SIZE`.
use halflight_native::images::Image;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (x, y) = (Image::read(a[1].as_ref()).unwrap(), Image::read(a[2].as_ref()).unwrap());
    let n: usize = a[3].parse().unwrap();
    let (i, t, al, z) =
        (x.rgb("indirect").unwrap(), y.rgb("indirect").unwrap(), y.rgb("albedo").unwrap(), y.surface_mask().unwrap());
    let w: usize = a[4].parse().unwrap();
    let h = i.len() / w;
    let mut v = Vec::new();
    for by in 0..h / n {
        for bx in 0..w / n {
            let mut s = [[0f64; 3]; 2];
            let mut c = 0.0;
            for k in 0..n * n {
                let p = (by * n + k / n) * w + bx * n + k % n;
                if z[p] {
                    c += 1.0;
                    for ch in 0..3 {
                        s[0][ch] += (i[p][ch] * al[p][ch]) as f64;
                        s[1][ch] += (t[p][ch] * al[p][ch]) as f64;
                    }
                }
            }
            if c > 0.0 {
                for ch in 0..3 {
                    v.push((s[0][ch] / c, s[1][ch] / c));
                }
            }
        }
    }
    let m = v.iter().map(|p| p.1).sum::<f64>() / v.len() as f64;
    let e = v.iter().map(|(x, t)| (x - t) * (x - t) / (t * t + 0.01 * m * m)).sum::<f64>() / v.len() as f64;
    let none = v.iter().map(|(_, t)| t * t / (t * t + 0.01 * m * m)).sum::<f64>() / v.len() as f64;
    println!(
        "relMSE over {n}x{n}: {e:.4} (none {none:.4}), mean ratio {:.4}",
        v.iter().map(|p| p.0).sum::<f64>() / v.iter().map(|p| p.1).sum::<f64>()
    );
}
