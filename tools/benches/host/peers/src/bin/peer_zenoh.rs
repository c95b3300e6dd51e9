//! zenoh: peers over loopback TCP, the frames themselves in zenoh's shared memory.

use ring_peers::{Bench, FRAME_BYTES};
use std::error::Error;
use std::time::Duration;
use zenoh::bytes::ZBytes;
use zenoh::qos::CongestionControl;
use zenoh::shm::{BlockOn, GarbageCollect, PosixShmProviderBackend, ShmProviderBuilder};
use zenoh::{Config, Wait};

type Failure = Box<dyn Error + Send + Sync>;

const ENDPOINT: &str = "[\"tcp/127.0.0.1:17447\"]";
const KEY: &str = "whisker/bench";
const POOL_FRAMES: usize = 4096;

fn config(publishes: bool) -> Result<Config, Failure> {
    let mut config = Config::default();
    config.insert_json5("scouting/multicast/enabled", "false")?;
    config.insert_json5("transport/shared_memory/enabled", "true")?;
    let (mine, none) = if publishes { ("listen", "connect") } else { ("connect", "listen") };
    config.insert_json5(&format!("{mine}/endpoints"), ENDPOINT)?;
    config.insert_json5(&format!("{none}/endpoints"), "[]")?;
    Ok(config)
}

fn publish(bench: &mut Bench) -> Result<i32, Failure> {
    let session = zenoh::open(config(true)?).wait()?;
    let publisher = session.declare_publisher(KEY).congestion_control(CongestionControl::Block).wait()?;
    let backend = PosixShmProviderBackend::builder(POOL_FRAMES * FRAME_BYTES).wait()?;
    let provider = ShmProviderBuilder::backend(backend).wait();
    let layout = provider.alloc_layout(FRAME_BYTES)?;
    let mut frame = [0u8; FRAME_BYTES];
    bench.start();
    while bench.next(&mut frame) {
        let mut buffer = layout.alloc().with_policy::<BlockOn<GarbageCollect>>().wait()?;
        buffer.copy_from_slice(&frame);
        publisher.put(ZBytes::from(buffer)).wait()?;
    }
    Ok(bench.finish())
}

fn subscribe(bench: &mut Bench) -> Result<i32, Failure> {
    let session = zenoh::open(config(false)?).wait()?;
    let subscriber = session.declare_subscriber(KEY).with(zenoh::handlers::FifoChannel::new(1024)).wait()?;
    std::thread::sleep(Duration::from_millis(500)); // the declaration reaches the publisher
    bench.ready();
    loop {
        let sample = match bench.waits() {
            true => subscriber.recv_timeout(Duration::from_millis(100))?,
            false => subscriber.try_recv()?,
        };
        match sample {
            Some(sample) => bench.take(&sample.payload().to_bytes()),
            None if bench.over() => return Ok(bench.report()),
            None => (),
        }
    }
}

fn main() -> Result<(), Failure> {
    let mut bench = Bench::from_args();
    let code = if bench.publishes() { publish(&mut bench)? } else { subscribe(&mut bench)? };
    std::process::exit(code);
}
