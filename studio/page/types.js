// The types of what goes through the doors of the Rust (studio/src/types.rs): a test compares them.

/** @typedef {{ address: number, opcode: number, kind: number, motor: number, value: number }} Request */
/** @typedef {{ request: Request, timeout: number }} Exchange */
/** @typedef {{ reply: number[] } | { no_reply: number } | { others: { asked: number, answered: number[] } } | 'address' | { lost: string } | 'interrupted'} Outcome */
/** @typedef {{ product: string, world: string | null, eeprom: string | null }} Start */
/** @typedef {{ start: Start, done: string[], until: number }} Play */
/** @typedef {{ eeprom: string }} Contents */
/** @typedef {{ text: string, product: string }} WorldText */
/** @typedef {{ product: string | null }} Image */
/** @typedef {{ line: string }} Line */
/** @typedef {{ ticket: number }} Ticket */
/** @typedef {{ replies: Finished[], lines: LineTold[], messages: string[], rows: SampleRow[], paused: boolean, powered: boolean, starts: number, stored: number, left: number | null, stopped: string | null, nap: number }} Turn */
/** @typedef {{ ticket: number, outcome: Outcome }} Finished */
/** @typedef {{ bytes: number[] }} Bytes */
/** @typedef {{ outcome: Outcome | null }} Taken */
/** @typedef {{ address: number, product: string | null }} Axes */
/** @typedef {{ request: Request, product: string | null }} Moved */
/** @typedef {{ stops: Request[], download: Download }} Noted */
/** @typedef {'same' | 'over' | { begun: { end: Request, clear: Request[] } }} Download */
/** @typedef {{ requests: Request[] }} Requests */
/** @typedef {{ address: number, product: string | null, is_virtual: boolean, texts: string[] }} Curves */
/** @typedef {{ product: string | null, is_virtual: boolean, requests: Request[] }} Shown */
/** @typedef {{ curves: Curve[], usual: string[] }} Offers */
/** @typedef {{ text: string, group: string, name: string, unit: string, decimals: number, note: string, request: Request | null, looked_at: boolean, in_memory: boolean }} Curve */
/** @typedef {{ texts: string[] }} Watched */
/** @typedef {{ at: number, values: (number | null)[] }} SampleRow */
/** @typedef {{ request: Request, outcome: Outcome }} Read */
/** @typedef {{ value: number | null }} Value */
/** @typedef {{ product: string | null, is_virtual: boolean, request: Request | null, begun: number, outcome: Outcome, ended: number }} Exchanged */
/** @typedef {{ address: number, timeout: number }} Reach */
/** @typedef {{ name: string, product: string | null }} Module */
/** @typedef {{ products: string[] }} Products */
/** @typedef {{ text: string, done: boolean }} Text */
/** @typedef {{ name: string, text: string }} NamedText */
/** @typedef {{ texts: NamedText[], main: string }} Sources */
/** @typedef {{ program: Sources, verify: boolean, run: boolean, autostart: boolean }} Load */
/** @typedef {{ what: 'run' | 'stop' | 'reset' }} Control */
/** @typedef {{ same: boolean, lost: string | null }} InTheWay */
/** @typedef {{ file: string | null, line: number }} InText */
/** @typedef {{ name: string, value: string }} NamedValue */
/** @typedef {{ address: number, place: InText | null, condition: string }} Breakpoint */
/** @typedef {{ text: string, running: boolean, ended: boolean, next: InText | null, registers: NamedValue[], variables: NamedValue[], watched: NamedValue[], breakpoints: Breakpoint[] }} Debugged */
/** @typedef {'axis' | 'global' | 'variable' | 'interrupt' | 'coordinate'} ParameterBank */
/** @typedef {{ bank: ParameterBank, number: number, axis: number }} ParameterPlace */
/** @typedef {{ place: ParameterPlace, value: number }} ParameterSetting */
/** @typedef {{ product: string | null }} ParametersOf */
/** @typedef {{ low: number, high: number }} ParameterRange */
/** @typedef {'no' | 'command' | 'automatic'} ParameterStored */
/** @typedef {{ bank: ParameterBank, number: number, name: string, unit: string, ranges: ParameterRange[], takes: string, default: number, writable: boolean, stored: ParameterStored, kept: boolean, clears: boolean, note: string }} ParameterRow */
/** @typedef {{ axes: number, rows: ParameterRow[] }} ParameterTables */
/** @typedef {{ of: ParameterPlace[] }} ParametersMeant */
/** @typedef {{ place: ParameterPlace, value: number | null, why: string }} ParameterTold */
/** @typedef {{ told: ParameterTold[] }} ParametersTold */
/** @typedef {{ to: ParameterSetting[], store: boolean }} ParametersWrite */
/** @typedef {{ name: string, from: number | null, to: ParameterSetting[], store: boolean }} ParametersRestore */
/** @typedef {{ product: string | null, axes: number, of: ParameterPlace[] | null }} ParametersStore */
/** @typedef {{ of: ParameterPlace[], writes: number, lines: string[] }} ParameterWrites */
/** @typedef {{ product: string | null, to: ParameterSetting[] }} ParametersToWrite */
/** @typedef {{ lines: string[] }} ParameterWords */
/** @typedef {{ name: string, text: string, product: string | null }} ParametersFile */
/** @typedef {{ place: ParameterPlace, value: number, name: string, interface: boolean, why: string }} ParameterLine */
/** @typedef {{ from: number | null, lines: ParameterLine[] }} ParameterLines */
/** @typedef {'module' | 'physical' | { own: OwnUnit }} ParameterUnits */
/** @typedef {{ name: string, microsteps: number }} OwnUnit */
/** @typedef {{ product: string | null, known: ParameterSetting[], steps: number | null, units: ParameterUnits }} ParameterView */
/** @typedef {{ view: ParameterView, settings: ParameterSetting[] }} ParametersShow */
/** @typedef {{ text: string, unit: string }} ParameterText */
/** @typedef {{ texts: ParameterText[] }} ParameterTexts */
/** @typedef {{ view: ParameterView, place: ParameterPlace, text: string }} ParameterTyped */
/** @typedef {{ what: string, done: number, total: number }} Progress */
/** @typedef {{ texts: NamedText[], main: string, product: string | null }} TextAsked */
/** @typedef {{ texts: NamedText[], main: string, product: string | null, line: number, column: number }} PlaceAsked */
/** @typedef {{ line: string, column: number, product: string | null }} LineAsked */
/** @typedef {{ lines: (number[])[], messages: Mistake[], more: string | null, commands: number[], labels: TextLabel[], used: number, room: number | null }} Checked */
/** @typedef {{ file: string | null, line: number, start: number, end: number, severity: Severity, words: string, advice: Advice | null }} Mistake */
/** @typedef {'error' | 'warning'} Severity */
/** @typedef {{ words: string } | { instead: string }} Advice */
/** @typedef {{ name: string, line: number }} TextLabel */
/** @typedef {{ start: number, end: number, items: CompletionItem[] }} Completion */
/** @typedef {{ text: string, note: string }} CompletionItem */
/** @typedef {{ found: Explanation | null }} Explained */
/** @typedef {{ start: number, end: number, words: string, place: TextPlace | null }} Explanation */
/** @typedef {{ file: string | null, line: number, column: number }} TextPlace */
/** @typedef {{ line: string, product: string | null }} TypedLine */
/** @typedef {{ ok: any } | { error: string } | { interrupted: string }} Answer */
/** @typedef {{ inputs: StatusPort[], axes: StatusAxis[], note: string | null }} StatusRequests */
/** @typedef {{ name: string, kind: StatusKind, unit: string, switchable: boolean, request: Request | null, set: StatusSwitch | null }} StatusPort */
/** @typedef {'digital' | 'switch' | 'analog' | 'measured' | 'output' | 'pull_ups'} StatusKind */
/** @typedef {{ on: Request, off: Request }} StatusSwitch */
/** @typedef {{ axis: number, requests: Request[], latches: boolean }} StatusAxis */
/** @typedef {{ product: string | null, axis: number, values: (number | null)[] }} StatusValues */
/** @typedef {{ lines: StatusLine[] }} StatusLines */
/** @typedef {{ severity: StatusSeverity, words: string }} StatusLine */
/** @typedef {'fine' | 'note' | 'warning' | 'error'} StatusSeverity */
/** @typedef {{ product: string | null, requests: Request[], values: (number | null)[] }} StatusRead */
/** @typedef {{ readings: StatusReading[] }} StatusReadings */
/** @typedef {{ text: string, on: boolean | null }} StatusReading */
/** @typedef {{ axis: number }} StatusOf */

/** @typedef {{ ticket: number | null, line: string }} LineTold */
/** @typedef {{ touchables: WorldTouchable[], stages: WorldStage[] }} WorldOffers */
/** @typedef {{ axis: number | null, name: string, how: WorldTouch, shown: string | null }} WorldTouchable */
/** @typedef {{ switch: WorldSwitch } | { number: WorldNumber } | { choice: WorldState[] }} WorldTouch */
/** @typedef {{ on: string, off: string }} WorldSwitch */
/** @typedef {{ before: string, behind: string, least: number, greatest: number, step: number, unit: string, once: boolean }} WorldNumber */
/** @typedef {{ name: string, line: string }} WorldState */
/** @typedef {{ turn: number, circle: number | null, lowest: number | null, highest: number | null, zones: WorldZone[] }} WorldStage */
/** @typedef {{ name: string, from: number | null, to: number | null }} WorldZone */
/** @typedef {{ row: SampleRow, paused: boolean, busy: boolean, factor: number, wanted: number | null, behind: number }} WorldSeen */
/** @typedef {{ session: number, title: string, made: SessionMaker | null, start: Start, texts: NamedText[], curves: string[], done: string[], until: number }} Session */
/** @typedef {{ version: string, hash: string }} SessionMaker */
/** @typedef {{ session: Session, name: string, lines: string[], readings: number, length: number }} SessionRead */
/** @typedef {{ text: string }} SessionText */

export {};
