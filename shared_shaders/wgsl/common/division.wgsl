// A long dispatch is divided into several, because watchdogs of browsers and systems end programs whose dispatch takes
// seconds (frame_graph/src/plan/division.rs). Each covers a rectangle of whole workgroups.

/// Where a dispatch begins in the whole. Shaders add it to their built-in values.
struct Division {
    // Its first workgroup, and the first invocation of that.
    workgroup: vec2u,
    invocation: vec2u,
}
