//! An evaluation's files: report.md, CSV and plots.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};

use super::campaign::Campaign;
use super::estimator::Estimator;
use super::{condition, csv, machine, table, write};
use crate::table as terminal;

/// What grows while experiments are run; without a folder nothing is written.
pub struct Report {
    folder: Option<PathBuf>,
    sections: Vec<String>,
}

impl Report {
    /// Makes the folder.
    pub fn new(folder: Option<PathBuf>) -> Result<Self> {
        if let Some(folder) = &folder {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        Ok(Self {
            folder,
            sections: Vec::new(),
        })
    }

    /// Adds a section.
    pub fn add(&mut self, section: String) {
        self.sections.push(section);
    }

    /// Writes a plot and shows it in the report.
    pub fn plot(&mut self, name: &str, svg: &str) -> Result<()> {
        self.file(&format!("{name}.svg"), svg)?;
        self.add(format!("![{name}]({name}.svg)\n"));
        Ok(())
    }

    /// Writes a file into the folder.
    pub fn file(&self, name: &str, text: &str) -> Result<()> {
        match &self.folder {
            Some(folder) => write(&folder.join(name), text),
            None => Ok(()),
        }
    }

    /// Writes all that is known of simulated trials so far.
    pub fn write_simulated(&self, campaign: &Campaign, wall: Duration) -> Result<()> {
        let mut facts = machine::facts();
        let setup = &campaign.setup;
        facts.extend([
            ("robot", setup.robot.name.clone()),
            ("seed", setup.seed.to_string()),
            (
                "trials",
                format!("{} a cell, {} s at 100 Hz each", setup.trials, setup.secs),
            ),
            ("wall time", wall_time(wall, campaign.threads())),
        ]);
        for (estimator, (secs, count)) in &campaign.taken {
            let told = format!(
                "{:.2} s a trial on one thread, simulation included",
                secs / *count as f64
            );
            facts.push((estimator, told));
        }
        let mut used: Vec<Estimator> = campaign.all().map(|(cell, _)| cell.estimator).collect();
        used.sort_unstable();
        used.dedup();
        let mut ends = vec![details(campaign)];
        ends.push(parameters(&used, setup.particles)?);
        self.file("trials.csv", &csv::trials(campaign))?;
        self.file("cells.csv", &csv::cells(campaign))?;
        self.write_text(&facts, &ends)
    }

    /// Writes report.md: facts, the sections, and what comes last.
    pub fn write_text(&self, facts: &[(&str, String)], ends: &[String]) -> Result<()> {
        let arguments: Vec<_> = std::env::args().skip(1).collect();
        let mut text = format!(
            "# How good the estimates are\n\nMade by `palpate {}`.\n\n",
            arguments.join(" ")
        );
        for (name, value) in facts {
            text += &format!("- {name}: {value}\n");
        }
        for section in self.sections.iter().chain(ends) {
            text += "\n";
            text += section;
        }
        self.file("report.md", &text)
    }

    /// Says where the files are.
    pub fn tell(&self) -> Result<()> {
        if let Some(folder) = &self.folder {
            terminal::print(&format!(
                "Written to {}: report.md, CSV and plots",
                folder.display()
            ))?;
        }
        Ok(())
    }
}

/// A duration, for people.
pub fn wall_time(wall: Duration, threads: usize) -> String {
    let secs = wall.as_secs();
    match secs {
        0..120 => format!("{:.1} s on {threads} threads", wall.as_secs_f64()),
        _ => format!("{} min {} s on {threads} threads", secs / 60, secs % 60),
    }
}

fn details(campaign: &Campaign) -> String {
    let mut text = String::from("## All cells\n");
    for condition in &condition::CONDITIONS {
        if campaign
            .all()
            .any(|(cell, _)| cell.condition == condition.name)
        {
            text += &format!("\n### {}", table::details(campaign, condition.name));
        }
    }
    if let Some((cell, reason)) = first_refusal(campaign) {
        text += &format!(
            "\nTrials that the simulator refuses are left out; the first, under {} on link {}: {reason}\n",
            cell.condition, cell.link
        );
    }
    text
}

fn first_refusal(campaign: &Campaign) -> Option<(&super::trial::Cell, &String)> {
    let refused = |outcomes: &'_ [super::trial::Outcome]| outcomes.iter().position(Result::is_err);
    campaign.all().find_map(|(cell, outcomes)| {
        let reason = outcomes[refused(outcomes)?].as_ref().err()?;
        Some((cell, reason))
    })
}

/// The parameters of the estimators, as files say them.
pub fn parameters(estimators: &[Estimator], particles: Option<usize>) -> Result<String> {
    let mut text = String::from("## Parameters\n");
    for estimator in estimators {
        let parameters = serde_yaml_ng::to_string(&estimator.parameters(particles))?;
        text += &format!("\n### {}\n\n```yaml\n{parameters}```\n", estimator.title());
    }
    Ok(text)
}
