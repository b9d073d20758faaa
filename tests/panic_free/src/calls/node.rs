//! The node of CANopen.

use core::hint::black_box as any;

use super::module::firmware;
use super::stand_ins::{BareNode, Chip, Nobody, Pin};
use super::{now, text};
use tmcm::can::Frame;
use tmcm::can::outbox::Outbox;
use tmcm::canopen::{self, BusState, Emergency, Entry, Node, Object, Overflow, ROWS};
use tmcm::chip::tmc429::Tmc429;
use tmcm::device::{Controller, Inputs, Parts};
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::product::Tmcm1140Canopen;
use tmcm::store::Store;
use tmcm::tmcl::binary::Addressed;

#[inline(never)]
pub(super) fn node() {
    let store: Option<&'static mut Store<Tmcm1140Canopen>> = any(None);
    let Some(store) = store else { return };
    let controllers = [Controller::new(Tmc429::new(Chip))];
    let parts = Parts { controllers, axes: Tmc429Tmc262::axes([Chip]), enable: Pin, store };
    let mut node: Node<BareNode> = Node::new(parts);
    any(&mut node);
    node.start(now(), |store| {
        any(store);
    });
    any(&mut node);
    if let Some(frame) = any(Frame::standard(any(0), text())) {
        node.receive(now(), &any(frame));
    }
    any(&mut node);
    any(node.next_frame());
    any(&mut node);
    any(node.poll(now(), &any(Inputs::default())));
    any(&mut node);
    firmware(&mut node);
    node.send(&mut Nobody);
    node.look_at(now(), &mut Nobody);
    any(&mut node);
    node.bus(now(), any(BusState::Off));
    node.lost(now(), any(Overflow::Receive));
    any(&mut node);
    any(node.filters());
    node.stored(any(true));
    any(&mut node);
    any((node.deadline(), node.takes_inputs(now()), node.node_id(), node.bit_rate(), node.state(), node.axes().len()));
    any((node.is_settled(), node.is_restarting(), node.store().next_job()));
    if let Ok(entry) = any(Entry::find(any(0), any(0))) {
        let row = entry.row();
        any((
            row.accepts(any(0)),
            row.default_number(any(0), any(0)),
            row.count(),
            row.slot(any(0)),
            row.follows_node(),
        ));
        any((row.data.number(), row.data.size(), row.data.range(), row.data.extend(any(0)), row.data.value(any(0))));
    }
    any((Entry::of(any(Object::DeviceType)).row().sub, ROWS.len()));
    let mut outbox = any(Outbox::default());
    any((outbox.has_room(), outbox.is_empty(), outbox.waits(), outbox.step()));
    if let Some(frame) = any(Frame::standard(any(0), text())) {
        any((outbox.post(&any(frame)), outbox.push(&any(frame))));
    }
    outbox.ended(any(0), any(false));
    outbox.clear().for_each(|mailbox| _ = any(mailbox));
    any(&mut outbox);
    any(node.serve_usb(now(), &any(Addressed::default())));
    node.remember(canopen::Address::from_kept(any([0; 2])));
    any(node.address().map(canopen::Address::to_kept));
    any(node.address().map(canopen::Address::bits_per_second));
    any((any(Emergency::Reset).data(), any(Emergency::Reset).reaction(), any(canopen::Abort::Toggle).code()));
    any(canopen::Abort::from_code(any(0)).map(canopen::Abort::meaning));
}
