//! iceoryx2: publish and subscribe without a copy; a waiting reader waits for an event sent after each frame.

use core::time::Duration;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use ring_peers::{Bench, FRAME_BYTES, Frame};
use std::error::Error;

const READERS: usize = 32;
const BUFFER: usize = 1024;

fn take_all(bench: &mut Bench, subscriber: &Subscriber<ipc::Service, Frame, ()>) -> Result<bool, Box<dyn Error>> {
    let mut any = false;
    while let Some(sample) = subscriber.receive()? {
        bench.take(&sample[..]);
        any = true;
    }
    Ok(any)
}

fn subscribe(
    bench: &mut Bench,
    subscriber: Subscriber<ipc::Service, Frame, ()>,
    listener: Listener<ipc::Service>,
) -> Result<i32, Box<dyn Error>> {
    bench.ready();
    loop {
        if bench.waits() {
            listener.timed_wait(|_| (), Duration::from_millis(100))?;
        }
        if !take_all(bench, &subscriber)? && bench.over() {
            return Ok(bench.report());
        }
    }
}

/// The exit code, when all that lies in shared memory has been let go.
fn run() -> Result<i32, Box<dyn Error>> {
    let mut bench = Bench::from_args();
    let node = NodeBuilder::new().create::<ipc::Service>()?;
    let frames = node
        .service_builder(&"whisker-bench/frames".try_into()?)
        .publish_subscribe::<Frame>()
        .subscriber_max_buffer_size(BUFFER)
        .max_subscribers(READERS)
        .max_nodes(READERS + 1)
        .open_or_create()?;
    let events = node
        .service_builder(&"whisker-bench/events".try_into()?)
        .event()
        .max_listeners(READERS)
        .max_nodes(READERS + 1)
        .open_or_create()?;
    if !bench.publishes() {
        let subscriber = frames.subscriber_builder().buffer_size(BUFFER).create()?;
        let listener = events.listener_builder().create()?;
        return subscribe(&mut bench, subscriber, listener);
    }
    let publisher = frames.publisher_builder().create()?;
    let notifier = events.notifier_builder().create()?;
    let mut frame = [0u8; FRAME_BYTES];
    bench.start();
    while bench.next(&mut frame) {
        publisher.loan_uninit()?.write_payload(frame).send()?;
        if bench.waits() {
            let _ = notifier.notify(); // a listener that has enough events is awake
        }
    }
    Ok(bench.finish())
}

fn main() -> Result<(), Box<dyn Error>> {
    set_log_level(LogLevel::Error);
    std::process::exit(run()?);
}
