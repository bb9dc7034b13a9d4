//! Standard output and standard error.
//!
//! `println!` panics where its output is closed or full. These functions return the error instead: [`PrintError`] has
//! the exit code and the sentence for it.

use std::{
    fmt,
    io::{self, Write},
};

/// Why text did not reach standard output.
#[derive(Debug)]
pub enum PrintError {
    /// The reader went away, as `head` does once it has enough. This is a normal end of a command.
    Closed,
    /// The text could not be written, for example to a full disk.
    Failed(io::Error),
}

impl PrintError {
    /// The exit code of a command that ends with this error: 0 for a closed output, 2 otherwise.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Closed => 0,
            Self::Failed(_) => 2,
        }
    }
}

impl fmt::Display for PrintError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed => write!(f, "standard output is closed"),
            Self::Failed(error) => {
                write!(f, "cannot write to standard output: {error}; free space there or write somewhere else")
            }
        }
    }
}

impl std::error::Error for PrintError {}

impl From<io::Error> for PrintError {
    fn from(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::BrokenPipe { Self::Closed } else { Self::Failed(error) }
    }
}

/// Prints text to standard output and flushes it.
///
/// # Errors
/// Where standard output is closed or cannot be written.
pub fn print(text: impl fmt::Display) -> Result<(), PrintError> {
    write_to(&mut io::stdout().lock(), format_args!("{text}"))
}

/// Prints a line to standard output and flushes it.
///
/// # Errors
/// Where standard output is closed or cannot be written.
pub fn print_line(text: impl fmt::Display) -> Result<(), PrintError> {
    write_to(&mut io::stdout().lock(), format_args!("{text}\n"))
}

/// Flushes standard output after other code wrote to it.
///
/// # Errors
/// Where standard output is closed or cannot be written.
pub fn flush() -> Result<(), PrintError> {
    Ok(io::stdout().lock().flush()?)
}

/// Writes a line to standard error: progress, warnings, the sentence that a command ends with. Where standard error
/// cannot be written there is nobody to inform, and the work goes on.
pub fn note(text: impl fmt::Display) {
    let _ = write_to(&mut io::stderr().lock(), format_args!("{text}\n"));
}

fn write_to(target: &mut impl Write, text: fmt::Arguments) -> Result<(), PrintError> {
    // Flushed, because what stays in the buffer until the process ends would be lost without a word.
    target.write_fmt(text)?;
    Ok(target.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Broken(io::ErrorKind);

    impl Write for Broken {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_closed_reader_is_a_normal_end_and_a_full_disk_is_one_sentence() {
        let of = |kind| write_to(&mut Broken(kind), format_args!("text")).expect_err("nothing can be written");
        assert_eq!(of(io::ErrorKind::BrokenPipe).exit_code(), 0);
        let full = of(io::ErrorKind::StorageFull);
        assert_eq!((full.exit_code(), full.to_string().lines().count()), (2, 1));
    }

    #[test]
    fn text_that_stays_in_a_buffer_counts_as_lost() {
        let mut buffered = io::BufWriter::new(Broken(io::ErrorKind::StorageFull));
        assert!(write_to(&mut buffered, format_args!("short")).is_err());
    }
}
