"""What the clients of the CANopen firmware have in common: a bus with modules, and checks on their nodes."""

from pathlib import Path

import canopen
from canopen.profiles.p402 import BaseNode402
from canopen.sdo import SdoAbortedError, SdoClient
from virtual_module import PATIENCE, check, equal, wait_for

EDS = Path(__file__).parents[2] / "docs" / "tmcm1140-canopen.eds"


def be_patient():
    """Gives python-canopen the time that a busy computer takes. For a fault reset it always waits as long as it may."""
    SdoClient.RESPONSE_TIMEOUT = PATIENCE
    BaseNode402.TIMEOUT_SWITCH_OP_MODE = PATIENCE
    BaseNode402.TIMEOUT_SWITCH_STATE_FINAL = PATIENCE
    BaseNode402.TIMEOUT_SWITCH_STATE_SINGLE = PATIENCE
    BaseNode402.TIMEOUT_CHECK_TPDO = PATIENCE
    BaseNode402.TIMEOUT_HOMING_DEFAULT = PATIENCE


class Bus:
    """The bus with its modules, and python-canopen's network on it."""

    def __init__(self, simulator):
        be_patient()
        self.simulator = simulator
        self.network = canopen.Network()
        self.network.connect(
            interface="slcan", channel=f"socket://{simulator.told['slcan-tcp']}", bitrate=1_000_000, sleep_after_open=0
        )

    def node(self, number, kind=canopen.RemoteNode):
        """A node with the objects of the EDS."""
        return self.network.add_node(kind(number, str(EDS)))

    def listen(self, identifier):
        """The list into which the data of frames with this identifier will come."""
        heard = []
        self.network.subscribe(identifier, lambda _, data, __: heard.append(bytes(data)))
        return heard


def aborts(what, code, action, *arguments, **options):
    """Checks that an SDO transfer is refused with this code."""
    try:
        action(*arguments, **options)
        check(what, False, "it is not refused")
    except SdoAbortedError as abort:
        check(what, abort.code == code, f"{abort.code:08X}h in place of {code:08X}h")


def emergency(what, node, code, register, first, second, count=1, on_the_way=()):
    """Waits for the node's emergency messages, of which the last is this one, and forgets them. Those with the codes
    `on_the_way` may come or not."""

    def heard():
        return [message for message in node.emcy.log if message.code not in on_the_way]

    wait_for(what, lambda: len(heard()) >= count)
    found = heard()[-1]
    equal(what, (found.code, found.register, found.data), (code, register, bytes([first, second, 0, 0, 0])))
    node.emcy.reset()


def reboot(node, command):
    """Resets the node or its communication, and waits until it has booted up."""
    boots = []
    node.nmt.add_heartbeat_callback(boots.append)
    node.nmt.state = command
    wait_for(f"boot-up after {command}", lambda: 0 in boots)
