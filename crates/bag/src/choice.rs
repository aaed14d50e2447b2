//! Which topics hold joint positions and external torques.

use palpate_model::{JointPicker, Robot, Source};

use crate::BagError;
use crate::bag::Bag;
use crate::reading::{Decoder, Quantity, pick};

/// Which topics to read, and how; where none is named, the one that fits is found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicChoice {
    /// Topic of the joint positions.
    pub positions: Option<String>,
    /// Topic of the external joint torques.
    pub torques: Option<String>,
    /// Where several topics of torques fit, one of this type is taken.
    pub source: Option<Source>,
    /// Joints of messages that do not name them; empty: the robot's, in its order.
    pub joint_names: Vec<String>,
}

/// Indices of the topics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chosen {
    pub(crate) positions: usize,
    pub(crate) torques: usize,
}

/// What a topic could serve as.
#[derive(Clone, Debug, Default)]
struct Fitness {
    source: Option<Source>,
    positions: bool,
    efforts: bool,
    /// Why a topic of a type that tells of joints cannot be read.
    obstacle: Option<String>,
}

/// Finds the topics of positions and torques; one and the same where its messages hold both.
pub(crate) fn choose(bag: &Bag, robot: &Robot, choice: &TopicChoice) -> Result<Chosen, BagError> {
    let named = |name: &Option<String>| name.as_deref().map(|name| bag.topic(name)).transpose();
    let (positions, torques) = (named(&choice.positions)?, named(&choice.torques)?);
    if let (Some(positions), Some(torques)) = (positions, torques) {
        return Ok(Chosen { positions, torques });
    }
    let fitness = fitness(bag, robot, choice)?;
    let torques = match torques {
        Some(topic) => topic,
        None => find_torques(bag, &fitness, choice.source)?,
    };
    let together = fitness[torques].source.is_some_and(Source::has_both);
    let positions = match positions {
        Some(topic) => topic,
        None if together => torques,
        None => the_only(
            bag,
            &fitness,
            "joint positions",
            "--positions",
            &fitting(&fitness, |topic| {
                topic.positions && topic.source == Some(Source::JointState)
            }),
        )?,
    };
    Ok(Chosen { positions, torques })
}

/// Finds the topic of `JointState` that has measured torques beside positions.
pub(crate) fn choose_measured(
    bag: &Bag,
    robot: &Robot,
    choice: &TopicChoice,
) -> Result<usize, BagError> {
    let named = |name: &Option<String>| name.as_deref().map(|name| bag.topic(name)).transpose();
    let (positions, torques) = (named(&choice.positions)?, named(&choice.torques)?);
    let fits = |topic: &Fitness| {
        topic.source == Some(Source::JointState) && topic.positions && topic.efforts
    };
    let fitness = fitness(bag, robot, choice)?;
    let fitting = match (positions, torques) {
        (None, None) => fitting(&fitness, fits),
        (Some(positions), Some(torques)) if positions != torques => Vec::new(),
        (Some(topic), _) | (None, Some(topic)) => vec![topic],
    };
    the_only(
        bag,
        &fitness,
        "joint positions with measured torques beside them",
        "--positions",
        &fitting,
    )
}

fn find_torques(bag: &Bag, fitness: &[Fitness], source: Option<Source>) -> Result<usize, BagError> {
    let all: Vec<_> = (0..fitness.len())
        .filter(|&topic| holds_external_torques(&bag.topics()[topic].name, &fitness[topic]))
        .collect();
    let of_source: Vec<_> = all
        .iter()
        .copied()
        .filter(|&topic| source.is_some() && fitness[topic].source == source)
        .collect();
    let fitting = if of_source.is_empty() { all } else { of_source };
    the_only(
        bag,
        fitness,
        "external joint torques",
        "--torques",
        &fitting,
    )
}

/// Whether a topic's efforts can be nothing but external torques.
fn holds_external_torques(name: &str, fitness: &Fitness) -> bool {
    fitness.efforts
        && match fitness.source {
            // Efforts beside positions are a driver's joint torques, gravity included.
            Some(Source::JointState) => !fitness.positions,
            // Commands look the same: only the topic's name tells.
            Some(Source::MultiArray) => name.contains("external_torque"),
            Some(_) => fitness.positions,
            None => false,
        }
}

fn fitting(fitness: &[Fitness], fits: impl Fn(&Fitness) -> bool) -> Vec<usize> {
    let all = 0..fitness.len();
    all.filter(|&topic| fits(&fitness[topic])).collect()
}

fn the_only(
    bag: &Bag,
    fitness: &[Fitness],
    what: &'static str,
    option: &'static str,
    fitting: &[usize],
) -> Result<usize, BagError> {
    let names: Vec<_> = fitting
        .iter()
        .map(|&topic| bag.topics()[topic].name.as_str())
        .collect();
    let obstacles = fitness.iter().filter_map(|topic| topic.obstacle.as_deref());
    let unreadable: String = obstacles.map(|reason| format!(" ({reason})")).collect();
    match fitting {
        [topic] => Ok(*topic),
        _ => Err(BagError::Choice {
            what,
            option,
            fitting: match names.len() {
                0 => format!("no topic fits{unreadable}"),
                count => format!("{count} topics fit ({})", names.join(", ")),
            },
            found: bag.topic_list(),
        }),
    }
}

/// What each topic could serve as: it does if one message has finite values for all of the robot's joints.
fn fitness(bag: &Bag, robot: &Robot, choice: &TopicChoice) -> Result<Vec<Fitness>, BagError> {
    let decoders: Vec<_> = (0..bag.topics().len())
        .map(|topic| Decoder::new(bag, topic))
        .collect();
    let mut fitness: Vec<_> = decoders
        .iter()
        .map(|decoder| Fitness {
            source: decoder.as_ref().ok().map(|decoder| decoder.source),
            obstacle: match decoder {
                Err(error @ BagError::Definition { .. }) => Some(error.to_string()),
                _ => None,
            },
            ..Fitness::default()
        })
        .collect();
    let readable: Vec<_> = fitting(&fitness, |topic| topic.source.is_some());
    let mut picker = JointPicker::new(robot, &choice.joint_names);
    for message in bag.messages(&readable)? {
        let fits = &mut fitness[message.topic];
        if fits.positions && fits.efforts {
            continue;
        }
        let decoder = decoders[message.topic].as_ref();
        if let Ok(Ok(reading)) = decoder.map(|decoder| decoder.decode(&message.data)) {
            let mut has = |quantity| pick(robot, &mut picker, &reading, quantity).is_ok();
            fits.positions |= has(Quantity::Position);
            fits.efforts |= has(Quantity::Effort);
        }
    }
    Ok(fitness)
}
