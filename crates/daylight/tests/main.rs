//! Daylight against closed forms.
