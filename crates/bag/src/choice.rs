//! Which topics hold joint positions and external torques.

use palpate_model::Robot;

use crate::BagError;
use crate::bag::Bag;
use crate::reading::{Decoder, NameCache, Quantity, pick};

/// Which topics to read; where none is named, the one that fits is found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicChoice {
    /// Topic of the joint positions.
    pub positions: Option<String>,
    /// Topic of the external joint torques.
    pub torques: Option<String>,
}

/// What a topic could serve as.
#[derive(Clone, Copy, Debug, Default)]
struct Fitness {
    positions: bool,
    efforts: bool,
}

/// Indices of the topics of positions and torques.
pub(crate) fn choose(
    bag: &Bag,
    robot: &Robot,
    choice: &TopicChoice,
) -> Result<(usize, usize), BagError> {
    let named = |name: &Option<String>| name.as_deref().map(|name| bag.topic(name)).transpose();
    let (positions, torques) = (named(&choice.positions)?, named(&choice.torques)?);
    if let (Some(positions), Some(torques)) = (positions, torques) {
        return Ok((positions, torques));
    }
    let fitness = fitness(bag, robot)?;
    let fitting = |fits: &dyn Fn(usize, Fitness) -> bool| -> Vec<usize> {
        let all = fitness.iter().copied().enumerate();
        all.filter(|(topic, fitness)| fits(*topic, *fitness))
            .map(|(topic, _)| topic)
            .collect()
    };
    let positions = match positions {
        Some(topic) => topic,
        None => the_only(
            bag,
            "joint positions",
            "--positions",
            &fitting(&|_, fitness| fitness.positions),
        )?,
    };
    let torques = match torques {
        Some(topic) => topic,
        None => the_only(
            bag,
            "external joint torques",
            "--torques",
            // Efforts beside positions are a driver's joint torques, gravity included.
            &fitting(&|topic, fitness| topic != positions && fitness.efforts && !fitness.positions),
        )?,
    };
    Ok((positions, torques))
}

fn the_only(
    bag: &Bag,
    what: &'static str,
    option: &'static str,
    fitting: &[usize],
) -> Result<usize, BagError> {
    let names: Vec<_> = fitting
        .iter()
        .map(|&topic| bag.topics()[topic].name.as_str())
        .collect();
    match fitting {
        [topic] => Ok(*topic),
        _ => Err(BagError::Choice {
            what,
            option,
            fitting: match names.len() {
                0 => "no topic fits".to_owned(),
                count => format!("{count} topics fit ({})", names.join(", ")),
            },
            found: bag.topic_list(),
        }),
    }
}

/// What each topic could serve as: it does if one message has finite values for all of the robot's joints.
fn fitness(bag: &Bag, robot: &Robot) -> Result<Vec<Fitness>, BagError> {
    let decoders: Vec<_> = (0..bag.topics().len())
        .map(|topic| Decoder::new(bag, topic).ok())
        .collect();
    let readable: Vec<_> = (0..decoders.len())
        .filter(|&topic| decoders[topic].is_some())
        .collect();
    let mut fitness = vec![Fitness::default(); decoders.len()];
    let mut names = NameCache::default();
    for message in bag.messages(&readable)? {
        let fits = &mut fitness[message.topic];
        if fits.positions && fits.efforts {
            continue;
        }
        let decoder = decoders[message.topic].as_ref();
        if let Some(Ok(reading)) = decoder.map(|decoder| decoder.decode(&message.data)) {
            let mut has = |quantity| pick(robot, &mut names, &reading, quantity).is_ok();
            fits.positions |= has(Quantity::Position);
            fits.efforts |= has(Quantity::Effort);
        }
    }
    Ok(fitness)
}
