//! External torques of a recording that has measured ones.

use palpate_bag::{BagError, MeasuredRecording, Recording};
use palpate_model::{ExternalTorque, PairingLosses};

/// What is made of the measured samples, in their order. A stamp that lies further back than `time_jump_secs` starts time
/// anew, as in the [track](crate::track::track).
///
/// # Errors
/// If not one sample gives an external torque; the first refusal is told.
pub fn recording(
    external: &mut ExternalTorque,
    measured: MeasuredRecording,
    time_jump_secs: f64,
) -> Result<Recording, BagError> {
    let mut samples = Vec::with_capacity(measured.samples.len());
    let mut last_ns = i64::MIN;
    let mut first_refusal = None;
    for sample in &measured.samples {
        let back_secs = last_ns.saturating_sub(sample.stamp_ns) as f64 * 1e-9;
        if back_secs > time_jump_secs {
            external.restart();
        }
        match external.update(sample) {
            Ok(sample) => {
                last_ns = sample.stamp_ns;
                samples.push(sample.clone());
            }
            Err(refusal) => {
                first_refusal.get_or_insert_with(|| refusal.to_string());
            }
        }
    }
    if let Some(refusal) = &first_refusal {
        let refused = external.counts().refused();
        tracing::warn!("{refused} measured samples refused, the first: {refusal}");
    }
    if let Some(beyond) = external.beyond_limit() {
        let count = external.counts().beyond_limit;
        tracing::warn!("{count} measured samples beyond a limit, the first: {beyond}");
    }
    if samples.is_empty() {
        let reason = first_refusal.unwrap_or_else(|| "there was none".to_owned());
        return Err(BagError::NoSample {
            reason: format!("{}: {reason}", measured.topic.topic),
        });
    }
    Ok(Recording {
        samples,
        positions: measured.topic.clone(),
        torques: measured.topic,
        losses: PairingLosses::default(),
    })
}

/// What became of measured samples, for the table.
pub fn told(external: &ExternalTorque) -> String {
    let counts = external.counts();
    let mut told = format!("{} samples", counts.used);
    let causes = [
        (counts.velocity_missing, "refused without speeds"),
        (counts.wrong_value, "refused as not finite"),
        (counts.wrong_length, "refused for their length"),
        (counts.stamp_not_after, "refused for their stamp"),
        (counts.beyond_limit, "beyond a joint's limit"),
    ];
    for (count, cause) in causes.iter().filter(|(count, _)| *count > 0) {
        told += &format!(", {count} {cause}");
    }
    told
}
