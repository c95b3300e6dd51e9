//! Aeron IPC. `peer_aeron driver` is the media driver, which runs beside publisher and subscribers.

use ring_peers::{Bench, FRAME_BYTES};
use rusteron_client::{AERON_IPC_STREAM, Aeron, Handlers};
use rusteron_media_driver::{AeronDriver, AeronDriverContext};
use std::error::Error;
use std::ffi::CString;
use std::time::{Duration, Instant};

const STREAM: i32 = 1001;
const TIMEOUT: Duration = Duration::from_secs(20);

fn folder() -> Result<String, Box<dyn Error>> {
    Ok(std::env::var("AERON_DIR")?)
}

fn drive() -> Result<(), Box<dyn Error>> {
    let context = AeronDriverContext::new()?;
    context.set_dir(&CString::new(folder()?)?)?;
    context.set_dir_delete_on_start(true)?;
    context.set_dir_delete_on_shutdown(true)?;
    let driver = AeronDriver::new(&context)?;
    driver.start(true)?;
    loop {
        driver.main_idle_strategy(driver.main_do_work()?);
    }
}

fn publish(bench: &mut Bench, aeron: &Aeron) -> Result<i32, Box<dyn Error>> {
    let publication = aeron.add_exclusive_publication(AERON_IPC_STREAM, STREAM, TIMEOUT)?;
    let mut frame = [0u8; FRAME_BYTES];
    bench.start();
    let deadline = Instant::now() + TIMEOUT;
    while !publication.is_connected() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    while bench.next(&mut frame) {
        while let Err(error) = publication.offer(&frame) {
            if !error.is_retryable() {
                return Err(error.into());
            }
            std::thread::yield_now();
        }
    }
    Ok(bench.finish())
}

fn subscribe(bench: &mut Bench, aeron: &Aeron) -> Result<i32, Box<dyn Error>> {
    let subscription = aeron.add_subscription(AERON_IPC_STREAM, STREAM, Handlers::NONE, Handlers::NONE, TIMEOUT)?;
    bench.ready();
    loop {
        let taken = subscription.poll_fn(|frame, _| bench.take(frame), 256)?;
        if taken == 0 && bench.over() {
            return Ok(bench.report());
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    if std::env::args().nth(1).as_deref() == Some("driver") {
        return drive();
    }
    let mut bench = Bench::from_args();
    let aeron = Aeron::connect_dir(&folder()?)?;
    let code = if bench.publishes() { publish(&mut bench, &aeron)? } else { subscribe(&mut bench, &aeron)? };
    std::process::exit(code);
}
