//! Settings, each declared once: type, default, range and description of a key in one place.

use super::problem::{Problem, key_below};
use std::collections::BTreeMap;

/// A part of a file that can be checked.
pub trait Settings {
    /// Appends what is wrong with it; `at` is the dotted key that leads here, empty for the file.
    fn check(&self, at: &str, problems: &mut Vec<Problem>);
}

impl<S: Settings> Settings for Option<S> {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        if let Some(settings) = self {
            settings.check(at, problems);
        }
    }
}

impl<S: Settings> Settings for Vec<S> {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        for (k, settings) in self.iter().enumerate() {
            settings.check(&format!("{at}[{k}]"), problems);
        }
    }
}

impl<S: Settings> Settings for BTreeMap<String, S> {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        for (name, settings) in self {
            settings.check(&key_below(at, name), problems);
        }
    }
}

/// Declares a table of a file.
///
/// ```text
/// settings! {
///     /// A brake.
///     pub struct BrakeSettings {
///         /// Rate, m/s^2.
///         rate_mps2: f64 = 1.0, in 0.1..=3.0;
///         /// Rate in an emergency, m/s^2.
///         emergency_mps2: f64 = 1.3, in 0.1..=3.0;
///         /// What it presses with.
///         cylinder: CylinderSettings = CylinderSettings::default(), nested;
///     }
///     also check_rates
/// }
/// ```
///
/// Every key is public. `= ...` is its default, `in` the range that it must lie in (both ends
/// count, and the schema states it too), and `nested` says that it holds settings that check
/// themselves. `also` names a method for what several keys say together; it takes a
/// [`Checker`](super::Checker).
///
/// Every time, delay and rate has a range. A run takes a day at most (86 million steps of 1 ms, some hours of
/// work), and a fault begins within it; most other moments end at 1e6 s, after any run. A message takes ten
/// minutes at most, and up to a minute of jitter: it is kept until it arrives. Sensors sample 1000 times a
/// second at most, once in a default step. A camera takes at least one picture in ten seconds, and no row or
/// exposure lasts longer than that. Times that brakes and equipment take end where nobody would run a train
/// with them.
///
/// Either all keys have a default or none has. Without one a key must be written, unless it is an
/// `Option` or has a serde attribute. Keys of an `enum`'s variants have no default.
macro_rules! settings {
    (
        $(#[$meta:meta])*
        pub struct $name:ident {
            $(
                $(#[$key_meta:meta])*
                $key:ident: $type:ty = $default:expr $(, $rule:tt $($range:expr)?)?;
            )*
        }
        $(also $also:ident)?
    ) => {
        $crate::settings::settings! {
            $(#[$meta])*
            #[serde(default)]
            pub struct $name {
                $( $(#[$key_meta])* $key: $type $(, $rule $($range)?)?; )*
            }
            $(also $also)?
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $( $key: $default, )* }
            }
        }
    };
    (
        $(#[$meta:meta])*
        pub struct $name:ident {
            $(
                $(#[$key_meta:meta])*
                $key:ident: $type:ty $(, $rule:tt $($range:expr)?)?;
            )*
        }
        $(also $also:ident)?
    ) => {
        #[derive(Clone, Debug, PartialEq)]
        #[derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        $(#[$meta])*
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[$key_meta])*
                $($( #[schemars(transform = $crate::settings::settings!(@schema $range))] )?)?
                pub $key: $type,
            )*
        }

        impl $crate::settings::Settings for $name {
            fn check(&self, at: &str, problems: &mut Vec<$crate::settings::Problem>) {
                let mut check = $crate::settings::Checker::new(at, problems);
                $($(
                    $crate::settings::settings!(
                        @$rule check, stringify!($key), &self.$key $(, $range)?
                    );
                )?)*
                $( self.$also(&mut check); )?
            }
        }
    };
    (
        $(#[$meta:meta])*
        pub enum $name:ident {
            $(
                $(#[$variant_meta:meta])*
                $variant:ident $({
                    $(
                        $(#[$key_meta:meta])*
                        $key:ident: $type:ty $(, $rule:tt $($range:expr)?)?;
                    )*
                })?,
            )*
        }
        $(also $also:ident)?
    ) => {
        #[derive(Clone, Debug, PartialEq)]
        #[derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        $(#[$meta])*
        #[serde(deny_unknown_fields)]
        pub enum $name {
            $(
                $(#[$variant_meta])*
                $variant $({
                    $(
                        $(#[$key_meta])*
                        $($( #[schemars(transform = $crate::settings::settings!(@schema $range))] )?)?
                        $key: $type,
                    )*
                })?,
            )*
        }

        impl $crate::settings::Settings for $name {
            fn check(&self, at: &str, problems: &mut Vec<$crate::settings::Problem>) {
                let mut check = $crate::settings::Checker::new(at, problems);
                match self {
                    $(
                        Self::$variant $({ $($key),* })? => {
                            $($(
                                let _ = $key;
                                $(
                                    $crate::settings::settings!(
                                        @$rule check, stringify!($key), $key $(, $range)?
                                    );
                                )?
                            )*)?
                        }
                    )*
                }
                $( self.$also(&mut check); )?
            }
        }
    };
    // The derive macro cannot read a range, but passes a macro on.
    (@schema $range:expr) => {
        $crate::settings::put_range($range)
    };
    (@in $check:ident, $key:expr, $numbers:expr, $range:expr) => {
        $check.within($key, $numbers, $range)
    };
    (@nested $check:ident, $key:expr, $settings:expr) => {
        $check.nested($key, $settings)
    };
}

pub(crate) use settings;
