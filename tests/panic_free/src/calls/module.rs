//! Ports, devices and modules.

use core::hint::black_box as any;

use super::stand_ins::{Added, Built, Nobody, parts};
use super::{Bare, command, now};
use tmcm::device::{Device, Inputs, Inversion};
use tmcm::firmware::{OnBoard, pass_on};
use tmcm::module::{LinkMode, LinkPort, LinkSettings, Message, Module, Request, Source, deliver, serve};
use tmcm::product::tmcm1140::AXIS;
use tmcm::tmcl::binary::Addressed;

#[inline(never)]
pub(super) fn port() {
    let mut port = LinkPort::new(any(Source::Usb), any(LinkMode::Binary));
    any(&mut port);
    let settings = any(LinkSettings::default());
    any(port.push(any(0), now(), || settings));
    any(&mut port);
    any(port.is_ready());
    any(port.is_binary());
    any(port.take());
    any(&mut port);
    any(port.is_waiting());
    let mut message = Message::new();
    any(&mut message);
    let _ = any(port.answer(any(None), any(None), any(settings.reply_addresses()), &mut message));
    any(&mut port);
    port.give_up();
    port.silence();
    any(&mut port);
}

#[inline(never)]
pub(super) fn device<P: Built<AXES>, const AXES: usize>() {
    let Some(parts) = parts::<P, AXES>() else { return };
    let mut device: Device<Bare<P, AXES>, AXES> = Device::new(parts, &AXIS);
    any(&mut device);
    device.halt();
    if let Some(parameter) = AXIS.find(any(0)) {
        device.preset(any(0), parameter, any(0));
    }
    let inversion = any(Inversion::default());
    device.start(now(), inversion);
    device.enable_drivers(any(true));
    any(&mut device);
    let _ = any(device.invert(inversion));
    any(device.begin(now(), &any(Inputs::default())));
    any(&mut device);
    any((device.next_piece(), device.deadline(), device.turn(), device.next_axis(now())));
    device.next_interpolations();
    device.next_reading();
    any(&mut device);
    any((device.is_locked(), device.lacks_supply(), device.is_given_up(), device.stop_switches(any(0))));
    any(device.calm());
    device.pass(any(0));
    any(device.end_moves(|axis| axis.hard_stop()));
    any(device.axis(any(0)).is_some());
    device.outputs_mut().restart = any(true);
    any((*device.outputs(), device.inputs().digital, device.axes().len()));
    device.restart_at(now());
    any(device.restart());
    let _ = any(device.start_together(now(), &any([None; AXES])));
    let _ = any(device.start_interpolation(now(), &any([None; AXES])));
    let _ = any(device.leave_interpolation(any(0)));
    let _ = any(device.repace(any(0)));
    let _ = any(device.command(any(0), |device| device.tell_each(any(0), |axis| axis.rotate(now(), any(0)))));
    any(device.store().get(any(0)));
    any(device.store_mut().next_job());
}

/// A firmware as that on which it runs calls it.
#[inline(never)]
pub(super) fn firmware<F: OnBoard<AXES>, const AXES: usize>(firmware: &mut F) {
    firmware.remember(any([0; 2]));
    any(firmware.serve(&mut Nobody));
    any(&mut *firmware);
    if let Some(outputs) = any(firmware.poll(now(), &any(Inputs::default()))) {
        pass_on(firmware, &mut Nobody, &outputs);
    }
    firmware.refill(&mut Nobody);
    any((firmware.deadline(), firmware.takes_inputs(now()), firmware.baud_rate(), firmware.can_bit_rate()));
    any((firmware.kept(), firmware.usb_name(), firmware.is_restarting(), firmware.awaits(any(Source::Can))));
    firmware.recover();
    firmware.forget(any(Source::Usb));
}

#[inline(never)]
pub(super) fn module<P: Built<AXES>, const AXES: usize>() {
    let spec = any(P::SPEC);
    any((spec.version_string(), spec.version_number()));
    let Some(parts) = parts::<P, AXES>() else { return };
    let mut module: Module<Bare<P, AXES>, AXES> = Module::new(parts, Added, any(0));
    any(&mut module);
    module.start(now(), |store| {
        any(store);
    });
    any(&mut module);
    let _ = any(module.execute(now(), any(Source::Usb), command()));
    any(&mut module);
    firmware(&mut module);
    any(module.poll(now(), &any(Inputs::default())));
    any(&mut module);
    any(serve(&mut module, &mut Nobody));
    deliver(&mut module, &mut Nobody);
    any(&mut module);
    let _ = any(module.request(now(), any(Source::Usb), &any(Request::Telegram(Addressed::default()))));
    any(&mut module);
    let due = any(module.next_reply());
    any(due.and_then(|due| Some(module.link_settings().frame(due.to, &due.reply?))));
    any(&mut module);
    any(module.next_event(|_| any(true)));
    any(&mut module);
    module.stored(any(true));
    any(&mut module);
    any((module.deadline(), module.takes_inputs(now()), module.subscriber(), module.awaits(any(Source::Usb))));
    any((module.spec().number, *module.link_settings(), module.machine().state(), module.axes().len()));
    any((module.baud_rate(), module.can_bit_rate(), module.calm(), module.is_restarting()));
    any(module.pass(any(0)));
    let _ = any(module.peek(now(), command()));
    any(module.store().next_job());
    any(module.hooks());
    module.forget(any(Source::Usb));
    module.hold_program();
}
