//! Ctrl-C in the middle of the work: the program ends within a second, with its own exit code; files that were
//! finished are whole, and nothing else is there.
//!
//! The second is the promise itself, so these tests look at the clock. Not handled: systems without signals.
#![cfg(unix)]

use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use crate::run::{contents, files, place};

/// Whether whoever started the tests ignores interrupts, as `nohup` does; then the program does so as well.
fn ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|m| u64::from_str_radix(m.trim(), 16).ok());
    // Hangup, interrupt and termination are signals 1, 2 and 15.
    mask.unwrap_or(0) & 0b100_0000_0000_0011 != 0
}

fn start(place: &TempDir, arguments: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_halflight"))
        .args(arguments.split_whitespace())
        .current_dir(place.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Sends an interrupt; the program must still be at work, and must end as promised.
#[track_caller]
fn interrupt(mut child: Child, what: &str) {
    assert!(child.try_wait().unwrap().is_none(), "{what} ended by itself");
    let sent = Instant::now();
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    let ended = child.wait_with_output().unwrap();
    let seconds = sent.elapsed().as_secs_f64();
    let message = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(130), "{what}: {message}");
    assert!(message.contains("interrupted"), "{what}: {message}");
    assert!(seconds < 1.0, "{what} ended after {seconds} s");
}

/// Waits for a file under the place whose path passes; false if the program ended first.
fn appears(child: &mut Child, place: &TempDir, wanted: impl Fn(&str) -> bool) -> bool {
    while child.try_wait().unwrap().is_none() {
        if contents(place).keys().any(|name| wanted(name)) {
            return true;
        }
        sleep(Duration::from_micros(200));
    }
    false
}

#[test]
fn every_long_command_ends_in_its_loops() {
    if ignored() {
        return;
    }
    for arguments in [
        "render furnished-room --mode global --patches 20000 --rays 65536",
        "render furnished-room --mode global --patches 300 --samples 65536 --size 1024x1024",
        "bounces furnished-room --mode shadowless --patches 20000 --rays 65536",
        "trace furnished-room --mode global --samples 100000",
        "compare --mode global --time 60",
    ] {
        let place = place(&[]);
        let child = start(&place, arguments);
        sleep(Duration::from_millis(700));
        interrupt(child, arguments);
        assert!(files(&place).is_empty(), "{arguments} leaves {:?}", files(&place));
    }
}

#[test]
fn a_finished_picture_stays_whole_when_the_next_is_interrupted() {
    if ignored() {
        return;
    }
    let place = place(&[]);
    let arguments = "trace furnished-room --samples 128 --size 64x64";
    let mut child = start(&place, arguments);
    assert!(appears(&mut child, &place, |name| name.ends_with(".png")));
    sleep(Duration::from_millis(100));
    interrupt(child, arguments);
    let found = contents(&place);
    let names: Vec<&String> = found.keys().filter(|n| !n.ends_with('/')).collect();
    assert_eq!(names, ["out/furnished-room-traced-global.png"]);
    // A PNG ends with its IEND chunk, whose checksum is ae 42 60 82.
    assert!(found[names[0]].ends_with(b"IEND\xae\x42\x60\x82"));
}

/// The moment that matters is when a temporary file is there. It is short, so many runs are tried; whichever way
/// each of them goes, the directory holds the old file or the new one.
#[test]
fn an_interrupt_while_a_file_is_written_leaves_the_old_or_the_new() {
    if ignored() {
        return;
    }
    let job = "render --mode local --patches 300 --rays 16 --samples 1 --size 512x512 -o p.exr";
    let old = b"the old picture".to_vec();
    let (mut caught, mut kept) = (0, 0);
    for _ in 0..12 {
        let place = place(&[]);
        std::fs::write(place.path().join("p.exr"), &old).unwrap();
        let mut child = start(&place, job);
        // The probe before the work is the first to appear: some are caught there, some in the writing.
        if appears(&mut child, &place, |name| name.contains(".halflight-")) {
            let pid = child.id().to_string();
            let _ = Command::new("kill").args(["-INT", &pid]).status();
            caught += 1;
        }
        let code = child.wait().unwrap().code();
        let found = contents(&place);
        assert_eq!(found.keys().collect::<Vec<_>>(), ["p.exr"]);
        let picture = &found["p.exr"];
        match code {
            Some(130) => kept += usize::from(*picture == old),
            code => assert!(code == Some(0) && picture.starts_with(b"\x76\x2f\x31\x01")),
        }
    }
    println!("{caught} caught with a temporary file, {kept} kept the old picture");
}
