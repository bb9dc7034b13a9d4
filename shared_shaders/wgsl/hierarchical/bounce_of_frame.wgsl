// Two bounces that alternate between frames (Soler & Hoel 2010, section 5.3).

/// The bounce that a frame gathers: the second one in odd frames. Even frames, and frames without a valid previous
/// frame, gather the first one.
fn bounce_of_frame(frame: u32, valid: u32) -> u32 {
    return select(1u, 2u, valid != 0u && (frame & 1u) == 1u);
}
