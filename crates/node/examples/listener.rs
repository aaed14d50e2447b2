//! Listens to `palpate/contact_pose` and tells, when it is ended, how long estimates took: from the sample's stamp, which
//! the driver gave on the same machine, to their receipt here. Prints count, median, 99th percentile and maximum, ms, as
//! JSON.

use std::process::ExitCode;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::Context as _;
use futures::{FutureExt, StreamExt};
use palpate_node::{messages, process};
use r2r::QosProfile;
use r2r::geometry_msgs::msg::PoseWithCovarianceStamped;

fn main() -> ExitCode {
    process::log();
    match listen() {
        Ok(latencies) => {
            println!("{}", summary(latencies));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("listener: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Latency of each estimate, ns.
fn listen() -> anyhow::Result<Vec<i64>> {
    let stop = process::watch_signals()?;
    let mut node = process::create_node("listener")?;
    let qos = QosProfile::sensor_data().keep_last(100);
    let mut poses = node.subscribe::<PoseWithCovarianceStamped>("palpate/contact_pose", qos)?;
    let mut latencies = Vec::new();
    while !process::stopped(&stop) {
        node.spin_once(Duration::from_millis(20));
        while let Some(Some(pose)) = poses.next().now_or_never() {
            let now = SystemTime::now().duration_since(UNIX_EPOCH);
            let now_ns = i64::try_from(now.context("the clock is before 1970")?.as_nanos())?;
            latencies.push(now_ns - messages::nanoseconds(&pose.header.stamp));
        }
    }
    Ok(latencies)
}

fn summary(mut latencies: Vec<i64>) -> serde_json::Value {
    latencies.sort_unstable();
    let quantile_ms = |share: f64| {
        let index = (latencies.len().saturating_sub(1) as f64 * share).round() as usize;
        latencies.get(index).map(|&ns| ns as f64 * 1e-6)
    };
    serde_json::json!({
        "count": latencies.len(),
        "p50_ms": quantile_ms(0.5),
        "p99_ms": quantile_ms(0.99),
        "max_ms": quantile_ms(1.0),
    })
}
