//! Finding a channel by what users write.

use super::{ChannelInfo, Recording, RecordingError, units};

impl Recording {
    /// The index (0-based) of the channel with a 1-based number.
    ///
    /// # Errors
    /// No such channel; the message lists what exists.
    pub fn channel_by_number(&self, number: usize) -> Result<usize, RecordingError> {
        match number.checked_sub(1) {
            Some(index) if index < self.channels.len() => Ok(index),
            _ => Err(RecordingError::UnknownChannelNumber {
                file: self.name.clone(),
                number,
                existing: self.existing_channels(),
            }),
        }
    }

    /// The index (0-based) of the channel with a name, without or with its unit; upper and lower
    /// case count only where both occur.
    ///
    /// # Errors
    /// No channel or several channels of that name; the message lists what exists and the nearest.
    pub fn channel_by_name(&self, name: &str) -> Result<usize, RecordingError> {
        let wanted = name.trim();
        let without_unit = units::split_unit(wanted).0;
        let rules: [&dyn Fn(&str) -> bool; 4] = [
            &|name| name == wanted,
            &|name| name == without_unit,
            &|name| name.eq_ignore_ascii_case(wanted),
            &|name| units::split_unit(name).0.eq_ignore_ascii_case(without_unit),
        ];
        for rule in rules {
            let named = |channel: &ChannelInfo| channel.name.as_deref().is_some_and(rule);
            let mut found = (0..).zip(&self.channels).filter(|(_, c)| named(c));
            if let Some((index, _)) = found.next() {
                return match found.count() {
                    0 => Ok(index),
                    others => Err(RecordingError::AmbiguousChannelName {
                        file: self.name.clone(),
                        name: wanted.to_owned(),
                        count: others + 1,
                        existing: self.existing_channels(),
                    }),
                };
            }
        }
        Err(self.unknown_name(wanted))
    }

    /// The index (0-based) of the channel that a user means by a text: a name, else a number.
    ///
    /// # Errors
    /// Those of [`channel_by_name`](Self::channel_by_name) and
    /// [`channel_by_number`](Self::channel_by_number).
    pub fn channel_index(&self, text: &str) -> Result<usize, RecordingError> {
        match (self.channel_by_name(text), text.trim().parse()) {
            (Err(RecordingError::UnknownChannelName { .. }), Ok(number)) => {
                self.channel_by_number(number)
            }
            (by_name, _) => by_name,
        }
    }

    fn unknown_name(&self, wanted: &str) -> RecordingError {
        // Beyond this similarity (Jaro-Winkler, 1 = equal) a name is worth proposing.
        const NEAR: f64 = 0.7;
        let names = self.channels.iter().filter_map(|c| c.name.as_deref());
        let nearest = names
            .map(|name| {
                let (name_lower, wanted) = (name.to_lowercase(), wanted.to_lowercase());
                // "force" means "ch1_force_V", however long that is.
                let within = wanted.len() > 2 && name_lower.contains(&wanted);
                let similarity = strsim::jaro_winkler(&name_lower, &wanted);
                (similarity + f64::from(u8::from(within)), name)
            })
            .filter(|(similarity, _)| *similarity >= NEAR)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        RecordingError::UnknownChannelName {
            file: self.name.clone(),
            name: wanted.to_owned(),
            nearest: nearest.map_or(String::new(), |(_, name)| {
                format!("; did you mean \"{name}\"?")
            }),
            existing: self.existing_channels(),
        }
    }

    /// `1 ("force"), 2 ("response")`, for messages.
    fn existing_channels(&self) -> String {
        // More would hide the message.
        const SHOWN: usize = 12;
        let shown = self.channels.iter().enumerate().take(SHOWN);
        let mut shown: Vec<String> = shown
            .map(|(at, channel)| match &channel.name {
                Some(name) => format!("{} (\"{name}\")", at + 1),
                None => (at + 1).to_string(),
            })
            .collect();
        if self.channels.len() > SHOWN {
            shown.push(format!("... {}", self.channels.len()));
        }
        shown.join(", ")
    }
}
