// Two bounces that take turns (Soler & Hoel 2010, section 5.3).

/// The bounce that a frame gathers: the second one in odd frames, the first one in even frames and wherever the frame
/// before left nothing to start from.
fn bounce_of_frame(frame: u32, valid: u32) -> u32 {
    return select(1u, 2u, valid != 0u && (frame & 1u) == 1u);
}
