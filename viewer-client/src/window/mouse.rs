//! From mouse events to gestures: orbit, pan, zoom, pick; or the hand, while the mouse is the hand.

use crate::overlay::situation::HandMode;
use crate::pointer::{Button, Press};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::ModifiersState;

/// Turn of the camera per pixel, radians.
const TURN: f32 = 0.007;
/// Pixels of a touch pad that count as a notch of a wheel.
const NOTCH_PIXELS: f32 = 30.0;

/// What the mouse means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Gesture {
    /// Turn the camera, radians.
    Orbit(f32, f32),
    /// Move the picture, pixels.
    Pan(f32, f32),
    /// Come nearer by so many notches.
    Zoom(f32),
    /// Pick what is here.
    Pick([f32; 2]),
    /// Lead the hand here.
    Lead([f32; 2]),
    /// Push the hand away by so many notches.
    Push([f32; 2], f32),
    /// A button of the stylus.
    Stylus(Button, Press),
}

/// What a held button does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drag {
    Orbit,
    Pan,
}

/// Where the pointer is and what is held.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mouse {
    at: [f32; 2],
    drag: Option<Drag>,
    modifiers: ModifiersState,
}

impl Mouse {
    /// Whether Shift is down.
    pub(super) fn shift(&self) -> bool {
        self.modifiers.shift_key()
    }

    /// The gesture of an event.
    pub(super) fn on(&mut self, event: &WindowEvent, hand: HandMode) -> Option<Gesture> {
        match event {
            WindowEvent::ModifiersChanged(modifiers) => {
                self.modifiers = modifiers.state();
                None
            }
            WindowEvent::CursorMoved { position, .. } => self.moved([position.x as f32, position.y as f32], hand),
            WindowEvent::MouseInput { state, button, .. } => self.pressed(*button, *state, hand),
            WindowEvent::MouseWheel { delta, .. } => {
                let notches = match delta {
                    MouseScrollDelta::LineDelta(_, y) => *y,
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y as f32 / NOTCH_PIXELS,
                };
                Some(if hand == HandMode::Hand { Gesture::Push(self.at, notches) } else { Gesture::Zoom(notches) })
            }
            WindowEvent::Focused(false) | WindowEvent::CursorLeft { .. } => {
                self.drag = None;
                None
            }
            _ => None,
        }
    }

    fn moved(&mut self, to: [f32; 2], hand: HandMode) -> Option<Gesture> {
        let [dx, dy] = [to[0] - self.at[0], to[1] - self.at[1]];
        self.at = to;
        match self.drag {
            Some(Drag::Orbit) => Some(Gesture::Orbit(TURN * dx, TURN * dy)),
            Some(Drag::Pan) => Some(Gesture::Pan(dx, dy)),
            None => (hand == HandMode::Hand).then_some(Gesture::Lead(to)),
        }
    }

    fn pressed(&mut self, button: MouseButton, state: ElementState, hand: HandMode) -> Option<Gesture> {
        let is_hand = hand == HandMode::Hand;
        if state == ElementState::Released {
            self.drag = None;
            return (is_hand && button == MouseButton::Left).then_some(Gesture::Stylus(Button::Front, Press::Up));
        }
        match button {
            MouseButton::Left if self.modifiers.control_key() => return Some(Gesture::Pick(self.at)),
            MouseButton::Left if is_hand => return Some(Gesture::Stylus(Button::Front, Press::Down)),
            MouseButton::Left if !self.modifiers.shift_key() => self.drag = Some(Drag::Orbit),
            MouseButton::Right => self.drag = Some(Drag::Orbit),
            MouseButton::Left | MouseButton::Middle => self.drag = Some(Drag::Pan),
            _ => {}
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use winit::dpi::PhysicalPosition;
    use winit::event::{DeviceId, TouchPhase};

    fn press(button: MouseButton, state: ElementState) -> WindowEvent {
        WindowEvent::MouseInput { device_id: DeviceId::dummy(), state, button }
    }

    fn to(x: f64, y: f64) -> WindowEvent {
        WindowEvent::CursorMoved { device_id: DeviceId::dummy(), position: PhysicalPosition::new(x, y) }
    }

    #[test]
    fn dragging_orbits_and_letting_go_ends_it() {
        let mut mouse = Mouse::default();
        assert_eq!(mouse.on(&to(10.0, 10.0), HandMode::Idle), None);
        assert_eq!(mouse.on(&press(MouseButton::Left, ElementState::Pressed), HandMode::Idle), None);
        assert_eq!(mouse.on(&to(20.0, 5.0), HandMode::Idle), Some(Gesture::Orbit(10.0 * TURN, -5.0 * TURN)));
        mouse.on(&press(MouseButton::Left, ElementState::Released), HandMode::Idle);
        assert_eq!(mouse.on(&to(30.0, 5.0), HandMode::Idle), None);
        mouse.on(&press(MouseButton::Middle, ElementState::Pressed), HandMode::Idle);
        assert_eq!(mouse.on(&to(31.0, 7.0), HandMode::Idle), Some(Gesture::Pan(1.0, 2.0)));
    }

    #[test]
    fn as_the_hand_the_left_button_is_the_stylus_and_the_right_one_orbits() {
        let mut mouse = Mouse::default();
        assert_eq!(mouse.on(&to(4.0, 5.0), HandMode::Hand), Some(Gesture::Lead([4.0, 5.0])));
        let front = |press| Some(Gesture::Stylus(Button::Front, press));
        assert_eq!(mouse.on(&press(MouseButton::Left, ElementState::Pressed), HandMode::Hand), front(Press::Down));
        assert_eq!(mouse.on(&press(MouseButton::Left, ElementState::Released), HandMode::Hand), front(Press::Up));
        mouse.on(&press(MouseButton::Right, ElementState::Pressed), HandMode::Hand);
        assert_eq!(mouse.on(&to(5.0, 5.0), HandMode::Hand), Some(Gesture::Orbit(TURN, 0.0)));
        let wheel = WindowEvent::MouseWheel {
            device_id: DeviceId::dummy(),
            delta: MouseScrollDelta::LineDelta(0.0, 2.0),
            phase: TouchPhase::Moved,
        };
        assert_eq!(mouse.on(&wheel, HandMode::Hand), Some(Gesture::Push([5.0, 5.0], 2.0)));
        assert_eq!(mouse.on(&wheel, HandMode::NoPointer), Some(Gesture::Zoom(2.0)));
    }
}
