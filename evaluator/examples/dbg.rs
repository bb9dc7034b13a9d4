use halflight_evaluator::experiment::session::{Request, Session, open_adapter, open_scene};
use halflight_techniques::technique;
fn main() {
    let native = open_adapter("any").unwrap();
    let scene = open_scene(std::path::Path::new("scenes/cornell.toml")).unwrap();
    let technique = technique("radiance-cache").unwrap();
    let settings = (technique.complete)(&Default::default()).unwrap();
    let session = Session::new(&native, &scene);
    let mut old: Vec<Vec<(Vec<u8>,Vec<u8>,Vec<u8>)>> = Vec::new();
    for run in 0..3 {
        let mut frames = session.frames(&Request { technique, settings: settings.clone(), size: [96, 64], seed: 0, direct: None }).unwrap();
        let mut all = Vec::new();
        for f in 0..2 {
            frames.run(f).unwrap();
            let c = frames.read_buffer("counters").unwrap().unwrap();
            let words: Vec<u32> = c.chunks_exact(4).map(|w| u32::from_le_bytes(w.try_into().unwrap())).collect();
            let cells = frames.read_buffer("cells").unwrap().unwrap();
            let records = frames.read_buffer("records").unwrap().unwrap();
            let totals = frames.read_buffer("totals").unwrap().unwrap();
            let mut set: Vec<(Vec<u8>,Vec<u8>,Vec<u8>)> = Vec::new();
            for (i, cell) in cells.chunks_exact(24).enumerate() {
                if cell[..4] != [0; 4] { set.push((records[i*80..i*80+16].to_vec(), [&cell[4..16], &records[i*80+16..i*80+64], &records[i*80+68..i*80+72]].concat(), totals[i*16..i*16+16].to_vec())); }
            }
            set.sort();
            print!("run {run} frame {f} {words:?} cells {} ", set.len());
            if let Some(old) = old.get(f as usize) {
                let d: Vec<_> = set.iter().zip(old).filter(|(a,b)| a.0!=b.0).take(2).collect();
                let e: Vec<_> = set.iter().zip(old).filter(|(a,b)| a.0==b.0 && a.1!=b.1).collect();
                let t: Vec<_> = set.iter().zip(old).filter(|(a,b)| a.0==b.0 && a.2!=b.2).collect();
                print!("places {} records {} totals {}", d.len(), e.len(), t.len());
            }
            for w in set.windows(2) { if w[0].0 == w[1].0 { print!(" DUP {:?} {:?}", w[0].0.chunks_exact(4).map(|w| i32::from_le_bytes(w.try_into().unwrap())).collect::<Vec<_>>(), w[0].1.chunks_exact(4).chain(w[1].1.chunks_exact(4)).map(|w| u32::from_le_bytes(w.try_into().unwrap())).collect::<Vec<_>>()); } }
            println!();
            all.push(set);
        }
        if run == 0 { old = all; }
    }
}
