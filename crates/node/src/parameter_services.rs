//! Parameters while the node runs: what `ros2 param list`, `get`, `set`, `describe` and `dump` ask for.
//!
//! r2r's own services have neither lists nor ranges, nor reasons for refusals.

use futures::{FutureExt, StreamExt};
use palpate_filter::{PARAMETER_TABLE, Settings, SettingsError};
use palpate_node::{as_listed, within_prefixes};
use r2r::builtin_interfaces::msg::Time;
use r2r::rcl_interfaces::msg::{
    FloatingPointRange, IntegerRange, ListParametersResult, Parameter, ParameterDescriptor,
    ParameterEvent, SetParametersResult,
};
use r2r::rcl_interfaces::srv::{
    DescribeParameters, GetParameterTypes, GetParameters, ListParameters, SetParameters,
    SetParametersAtomically,
};
use r2r::{Publisher, QosProfile, WrappedServiceTypeSupport};

use crate::parameters::{from_message, kind, to_message};
use crate::services::Requests;

/// The settings in effect, and the services that read and change them.
pub struct ParameterServices {
    settings: Settings,
    set: Requests<SetParameters::Service>,
    set_atomically: Requests<SetParametersAtomically::Service>,
    queries: Queries,
    events: Publisher<ParameterEvent>,
    node: String,
}

struct Queries {
    get: Requests<GetParameters::Service>,
    types: Requests<GetParameterTypes::Service>,
    list: Requests<ListParameters::Service>,
    describe: Requests<DescribeParameters::Service>,
}

impl ParameterServices {
    pub fn new(node: &mut r2r::Node, settings: Settings, now: Time) -> r2r::Result<Self> {
        let qos = QosProfile::parameters;
        let services = Self {
            set: Box::new(node.create_service("~/set_parameters", qos())?),
            set_atomically: Box::new(node.create_service("~/set_parameters_atomically", qos())?),
            queries: Queries {
                get: Box::new(node.create_service("~/get_parameters", qos())?),
                types: Box::new(node.create_service("~/get_parameter_types", qos())?),
                list: Box::new(node.create_service("~/list_parameters", qos())?),
                describe: Box::new(node.create_service("~/describe_parameters", qos())?),
            },
            events: node.create_publisher("/parameter_events", QosProfile::parameter_events())?,
            node: node.fully_qualified_name()?,
            settings,
        };
        let event = ParameterEvent {
            new_parameters: parameters(&services.settings),
            ..ParameterEvent::default()
        };
        services.tell(&now, event)?;
        Ok(services)
    }

    /// The settings in effect.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Answers what came in. Whether settings changed.
    ///
    /// # Errors
    /// If ROS 2 refuses to publish.
    pub fn serve(&mut self, now: &Time) -> r2r::Result<bool> {
        self.queries.serve(&self.settings);
        // This is asked at each sample, and settings hold the whole description of the robot: copied where they may change.
        let mut before = None;
        let settings = &mut self.settings;
        answer(&mut self.set, |request| {
            before.get_or_insert_with(|| settings.clone());
            let mut set = |parameter: &Parameter| change(settings, std::slice::from_ref(parameter));
            SetParameters::Response {
                results: request.parameters.iter().map(&mut set).collect(),
            }
        });
        answer(&mut self.set_atomically, |request| {
            before.get_or_insert_with(|| settings.clone());
            SetParametersAtomically::Response {
                result: change(settings, &request.parameters),
            }
        });
        let changed = match before {
            Some(before) => changes(&before, &self.settings),
            None => return Ok(false),
        };
        if changed.is_empty() {
            return Ok(false);
        }
        let event = ParameterEvent {
            changed_parameters: changed,
            ..ParameterEvent::default()
        };
        self.tell(now, event)?;
        Ok(true)
    }

    fn tell(&self, now: &Time, event: ParameterEvent) -> r2r::Result<()> {
        self.events.publish(&ParameterEvent {
            stamp: now.clone(),
            node: self.node.clone(),
            ..event
        })
    }
}

impl Queries {
    fn serve(&mut self, settings: &Settings) {
        answer(&mut self.get, |request| GetParameters::Response {
            values: known(settings, &request.names)
                .map(|parameter| parameter.value)
                .collect(),
        });
        answer(&mut self.types, |request| GetParameterTypes::Response {
            types: known(settings, &request.names)
                .map(|parameter| parameter.value.type_)
                .collect(),
        });
        answer(&mut self.list, |request| {
            let listed = parameters(settings).into_iter().map(|at| at.name);
            let names = listed
                .filter(|name| within_prefixes(name, &request.prefixes, request.depth))
                .collect();
            let (names, prefixes) = as_listed(names);
            ListParameters::Response {
                result: ListParametersResult { names, prefixes },
            }
        });
        answer(&mut self.describe, |request| DescribeParameters::Response {
            descriptors: known(settings, &request.names).map(describe).collect(),
        });
    }
}

/// Answers each request that came in.
fn answer<T: WrappedServiceTypeSupport + 'static>(
    requests: &mut Requests<T>,
    mut reply: impl FnMut(&T::Request) -> T::Response,
) {
    while let Some(Some(request)) = requests.next().now_or_never() {
        let response = reply(&request.message);
        // The client may have gone, which is no reason to end.
        if let Err(error) = request.respond(response) {
            tracing::debug!("an answer about parameters was not sent: {error}");
        }
    }
}

fn parameters(settings: &Settings) -> Vec<Parameter> {
    let flat = settings.to_flat().into_iter();
    flat.map(|(name, value)| Parameter {
        name,
        value: to_message(&value),
    })
    .collect()
}

/// The named parameters, in order; one without a value where there is none of the name.
fn known<'a>(settings: &Settings, names: &'a [String]) -> impl Iterator<Item = Parameter> + 'a {
    let all = parameters(settings);
    names.iter().map(move |name| {
        let found = all.iter().find(|parameter| parameter.name == *name);
        found.cloned().unwrap_or_else(|| Parameter {
            name: name.clone(),
            ..Parameter::default()
        })
    })
}

/// Changes all of them or none.
fn change(settings: &mut Settings, parameters: &[Parameter]) -> SetParametersResult {
    let values = parameters.iter();
    let values = values.map(|parameter| (parameter.name.clone(), from_message(&parameter.value)));
    let changed: Result<Settings, SettingsError> = settings.changed(values);
    match changed {
        Ok(changed) => {
            *settings = changed;
            SetParametersResult {
                successful: true,
                reason: String::new(),
            }
        }
        Err(refusal) => {
            tracing::warn!("refused: {refusal}");
            SetParametersResult {
                successful: false,
                reason: refusal.to_string(),
            }
        }
    }
}

/// What differs, as it is now.
fn changes(before: &Settings, now: &Settings) -> Vec<Parameter> {
    let pairs = parameters(before).into_iter().zip(parameters(now));
    pairs
        .filter(|(before, now)| before != now)
        .map(|(_, now)| now)
        .collect()
}

fn describe(parameter: Parameter) -> ParameterDescriptor {
    let mut descriptor = ParameterDescriptor {
        type_: parameter.value.type_,
        ..ParameterDescriptor::default()
    };
    if let Some(row) = PARAMETER_TABLE
        .iter()
        .find(|row| row.name == parameter.name)
    {
        descriptor.description = match row.unit {
            "" => row.meaning.to_owned(),
            unit => format!("{} ({unit})", row.meaning),
        };
        descriptor.additional_constraints = row.range.replace('`', "");
        descriptor.read_only = !row.live;
        let [least, most] = row.bounds.unwrap_or_default();
        match parameter.value.type_ {
            kind::INTEGER => descriptor.integer_range.push(IntegerRange {
                from_value: least as i64,
                to_value: most as i64,
                step: 0,
            }),
            kind::DOUBLE => {
                descriptor.floating_point_range.push(FloatingPointRange {
                    from_value: least,
                    to_value: most,
                    step: 0.0,
                });
            }
            _ => {}
        }
    }
    descriptor.name = parameter.name;
    descriptor
}
