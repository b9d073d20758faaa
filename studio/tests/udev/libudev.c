/* Stands in for libudev in a web browser, so that its Web Serial finds ports on a computer without any.
 *
 * Browsers ask libudev which devices there are, and which come and go. Preloaded, this library tells them that each entry
 * of the folder STAND_IN_PORTS whose name begins with "tty", a link to a pseudo terminal, is a USB serial port: made, it
 * is plugged in, and removed, unplugged. Whatever a browser does with a port, from open() on, is its own, but for ioctl()
 * below. The environment says what ports these are: STAND_IN_VENDOR_ID and STAND_IN_MODEL_ID, four hexadecimal digits
 * each, and STAND_IN_MODEL, a name.
 *
 * It has the functions that Chromium 156 imports, among which are those that Firefox 153 looks up. Apart from the ports
 * there is no device. Watchers of other subsystems count on hearing of nothing else, so filters are kept.
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#define SYSPATH "/sys/devices/stand-in/"
/* The major number of a driver of USB modems. Chromium takes for serial ports what has the number of a driver of the type
 * "serial" in /proc/tty/drivers, where the test bed puts this one. */
#define MAJOR "166"
/* The major number of pseudo terminals, on the side that stands for the port. */
#define PTY 136

/* A port, as a device and as an entry of a list. */
struct port {
    struct port *next;
    const char *action;
    char syspath[sizeof SYSPATH + NAME_MAX], node[PATH_MAX];
};
/* What asks for devices, once or as they come and go: an enumeration with what it has found, or a monitor. */
struct query {
    int filtered, passes_ports, descriptor;
    struct port *found;
};

static const char *told(const char *variable, const char *otherwise) {
    const char *value = getenv(variable);
    return value ? value : otherwise;
}

static const char *folder(void) { return told("STAND_IN_PORTS", "/nonexistent"); }

static int is_port(const char *name) { return !strncmp(name, "tty", 3); }

static int wants_ports(const struct query *query) { return query->passes_ports || !query->filtered; }

static struct port *new_port(const char *name, const char *action) {
    struct port *port = calloc(1, sizeof *port);
    port->action = action;
    snprintf(port->syspath, sizeof port->syspath, SYSPATH "%s", name);
    snprintf(port->node, sizeof port->node, "%s/%s", folder(), name);
    return port;
}

/* The library itself has no state; all that browsers want of this is an address. */
const void *udev_new(void) { return SYSPATH; }
void *udev_unref(void *udev) { return (void)udev, NULL; }

struct query *udev_enumerate_new(void *udev) { return (void)udev, calloc(1, sizeof(struct query)); }

int udev_enumerate_add_match_subsystem(struct query *query, const char *subsystem) {
    query->filtered = 1;
    query->passes_ports |= !strcmp(subsystem, "tty");
    return 0;
}

int udev_enumerate_scan_devices(struct query *query) {
    DIR *opened = wants_ports(query) ? opendir(folder()) : NULL;
    for (struct dirent *entry; opened && (entry = readdir(opened));)
        if (is_port(entry->d_name)) {
            struct port *port = new_port(entry->d_name, NULL);
            port->next = query->found;
            query->found = port;
        }
    return opened ? closedir(opened) : 0;
}

struct port *udev_enumerate_get_list_entry(struct query *query) { return query->found; }
struct port *udev_list_entry_get_next(struct port *port) { return port->next; }
const char *udev_list_entry_get_name(struct port *port) { return port->syspath; }

void *udev_enumerate_unref(struct query *query) {
    for (struct port *port; (port = query->found); free(port))
        query->found = port->next;
    return free(query), NULL;
}

struct query *udev_monitor_new_from_netlink(void *udev) {
    struct query *query = udev_enumerate_new(udev);
    query->descriptor = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    return query;
}

int udev_monitor_filter_add_match_subsystem_devtype(struct query *query, const char *subsystem) {
    return udev_enumerate_add_match_subsystem(query, subsystem);
}

int udev_monitor_enable_receiving(struct query *query) {
    if (wants_ports(query))
        inotify_add_watch(query->descriptor, folder(), IN_CREATE | IN_MOVED_TO | IN_DELETE | IN_MOVED_FROM);
    return 0;
}

int udev_monitor_get_fd(struct query *query) { return query->descriptor; }

struct port *udev_monitor_receive_device(struct query *query) {
    _Alignas(struct inotify_event) char buffer[sizeof(struct inotify_event) + NAME_MAX + 1];
    struct inotify_event *event = (struct inotify_event *)buffer;
    /* One event and no more, so that the descriptor stays readable while there are others: the kernel fills names up to
     * multiples of 16 bytes, and gives nothing if the next event has no room. */
    for (size_t room = sizeof *event; room <= sizeof buffer; room += 16)
        if (read(query->descriptor, buffer, room) > 0) {
            const char *action = event->mask & (IN_DELETE | IN_MOVED_FROM) ? "remove" : "add";
            return event->len && is_port(event->name) ? new_port(event->name, action) : NULL;
        }
    return NULL;
}

void *udev_monitor_unref(struct query *query) {
    close(query->descriptor);
    return udev_enumerate_unref(query);
}

struct port *udev_device_new_from_syspath(void *udev, const char *syspath) {
    size_t length = strlen(SYSPATH);
    return (void)udev, strncmp(syspath, SYSPATH, length) ? NULL : new_port(syspath + length, NULL);
}

void *udev_device_unref(struct port *port) { return free(port), NULL; }

const char *udev_device_get_action(struct port *port) { return port->action; }
const char *udev_device_get_devnode(struct port *port) { return port->node; }
const char *udev_device_get_driver(struct port *port) { return (void)port, "cdc_acm"; }
const char *udev_device_get_subsystem(struct port *port) { return (void)port, "tty"; }
const char *udev_device_get_sysname(struct port *port) { return port->syspath + strlen(SYSPATH); }
const char *udev_device_get_syspath(struct port *port) { return port->syspath; }

const char *udev_device_get_property_value(struct port *port, const char *name) {
    const char *model = told("STAND_IN_MODEL", "TMCM");
    const char *values[][2] = {
        {"DEVNAME", port->node}, {"SUBSYSTEM", "tty"}, {"MAJOR", MAJOR}, {"MINOR", "0"}, {"ID_BUS", "usb"},
        {"ID_VENDOR_ID", told("STAND_IN_VENDOR_ID", "2a3c")}, {"ID_MODEL_ID", told("STAND_IN_MODEL_ID", "0100")},
        {"ID_MODEL", model}, {"ID_MODEL_ENC", model},
    };
    for (size_t at = 0; at < sizeof values / sizeof *values; at++)
        if (!strcmp(values[at][0], name))
            return values[at][1];
    return NULL;
}

/* Of what there is not: types, parents and files of a port, and other ways to a device. */
void *udev_device_get_devtype(void) { return NULL; }
void *udev_device_get_parent(void) { return NULL; }
void *udev_device_get_parent_with_subsystem_devtype(void) { return NULL; }
void *udev_device_get_properties_list_entry(void) { return NULL; }
void *udev_device_get_sysattr_value(void) { return NULL; }
void *udev_device_new_from_devnum(void) { return NULL; }
void *udev_device_new_from_subsystem_sysname(void) { return NULL; }

/* A pseudo terminal has no lines of a modem, and Firefox takes nothing without them for a serial port. A USB port has: the
 * host's are set as it likes, the module's are off. */
int ioctl(int descriptor, unsigned long request, ...) {
    static int (*real)(int, unsigned long, ...);
    if (!real)
        real = (int (*)(int, unsigned long, ...))dlsym(RTLD_NEXT, "ioctl");
    va_list rest;
    va_start(rest, request);
    void *argument = va_arg(rest, void *);
    va_end(rest);
    struct stat found;
    int sets = request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC;
    if (!(sets || request == TIOCMGET) || fstat(descriptor, &found) || major(found.st_rdev) != PTY)
        return real(descriptor, request, argument);
    if (!sets)
        *(int *)argument = TIOCM_DTR | TIOCM_RTS;
    return 0;
}
