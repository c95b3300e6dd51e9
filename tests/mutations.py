#!/usr/bin/env python3
"""Breaks one part of the chain after another, in a copy, and expects the tests to go red.

    .venv/bin/python tests/mutations.py            every mutation: about a quarter of an hour
    .venv/bin/python tests/mutations.py swap       those whose name contains "swap"
    .venv/bin/python tests/mutations.py --near     only the test that ought to notice first, not all when it stays green
    .venv/bin/python tests/mutations.py --copy DIR in this copy, which is made if it is not there, and kept

Exit code 1 when one survives, that is, when every test stays green although a part is broken.
"""

import argparse
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = "build/release"
# Tests whose program has another name, and what tests in Python run.
PROGRAMS = {
    "node_slowest_link": "node_link",
    "sim_create.sensors": "test_create_sensors",
    "sim_create.modes": "test_create_modes",
    "sim_create.stream": "test_create_stream",
    "sim_create.remainder": "test_create_remainder",
    "host/python/tests/pilot/test_base.py": "whisker-base",
}


@dataclass(frozen=True)
class Mutation:
    """A part broken: in `file`, `old` becomes `new`. `near`: the program or pytest path that ought to notice first."""

    name: str
    near: str
    file: str
    old: str
    new: str


MUTATIONS = [
    Mutation(
        "firmware: byte order of the sensor's alpha",
        "test_sensor_frame",
        "firmware/dspic/core/sensor_frame.c",
        "whisker_get_u16(frame + MLX90333_FRAME_ALPHA),\n        whisker_get_u16(frame + MLX90333_FRAME_BETA)",
        "(uint16_t)(frame[1] << 8 | frame[2]),\n        whisker_get_u16(frame + MLX90333_FRAME_BETA)",
    ),
    Mutation(
        "firmware: record bytes swapped in their SPI words",
        "test_record",
        "firmware/dspic/core/record.c",
        "words[i] = (uint16_t)((uint16_t)bytes[2u * i] << 8 | bytes[2u * i + 1u]);",
        "words[i] = (uint16_t)((uint16_t)bytes[2u * i + 1u] << 8 | bytes[2u * i]);",
    ),
    Mutation(
        "firmware: a node that does not count ticks",
        "test_sim_node",
        "firmware/dspic/core/node.c",
        "node->tick = order.tick;",
        "node->tick = (uint8_t)(order.tick & 0x7Fu);",
    ),
    Mutation(
        "sensor: an angle mis-scaled by one part in a hundred",
        "test_mlx90333_sense",
        "sim/mlx90333/mlx90333_sense.c",
        "angle_deg * (steps / p->span_deg)",
        "angle_deg * 1.01 * (steps / p->span_deg)",
    ),
    Mutation(
        "sensor: sum without the error word",
        "test_sensor_frame",
        "firmware/dspic/core/sensor_frame.c",
        "if (sum == sensor_frame_sum_of(data, MLX90333_FRAME_SUM - MLX90333_FRAME_ALPHA))",
        "if (sum == sensor_frame_sum_of(data, MLX90333_FRAME_ERRORS - MLX90333_FRAME_ALPHA))",
    ),
    Mutation(
        "firmware: an overflow of the sensor's SPI is not cleared",
        "test_node_faults",
        "firmware/dspic/port_dspic/sensor_spi.c",
        "    sfr_write(board, SPI1STAT, 0);\n    sfr_write(board, SPI1CON1, SENSOR_CON1);\n    sfr_write(",
        "    sfr_write(board, SPI1CON1, SENSOR_CON1);\n    sfr_set(",
    ),
    Mutation(
        "firmware: the link's module goes on where extra clocks left it",
        "test_sim_node",
        "firmware/dspic/port_dspic/link_spi.c",
        "    sfr_write(board, SPI2STAT, 0); /* bits, words, overflow */\n",
        "",
    ),
    Mutation(
        "firmware: a first word that the slave does not hold is not written again",
        "test_port",
        "firmware/dspic/port_dspic/link_spi.c",
        "SPI2STAT);\n    sfr_write(board, SPI2BUF, word);\n",
        "SPI2STAT);\n",
    ),
    Mutation(
        "firmware: no resynchronisation after a bad frame",
        "test_sampler",
        "firmware/dspic/core/sampler.c",
        "    if (sampler_is_good(reading))\n        sampler->state",
        "    if (reading)\n        sampler->state",
    ),
    Mutation(
        "firmware: a sum without the error word is not accepted beside one",
        "test_sensor_frame",
        "firmware/dspic/core/sensor_frame.c",
        "return error_word != 0 && sum == sensor_frame_sum_of(data, MLX90333_FRAME_ERRORS - MLX90333_FRAME_ALPHA);",
        "return false;",
    ),
    Mutation(
        "firmware: any start byte will do",
        "test_sensor_frame",
        "firmware/dspic/core/sensor_frame.c",
        "if (frame[MLX90333_FRAME_START] != MLX90333_START_BYTE)",
        "if (frame[MLX90333_FRAME_START] == 0)",
    ),
    Mutation(
        "firmware: any step of the angle is believed",
        "test_sampler",
        "firmware/dspic/core/sampler.c",
        "return by > SAMPLER_STEP_MOST;",
        "return by > UINT16_MAX - 1u;",
    ),
    Mutation(
        "firmware: an order long after SYNC is believed",
        "test_node_faults",
        "firmware/dspic/core/node.c",
        "node->displaced = board_watch_exceeds(node->board, NODE_ORDER_MOST_US);",
        "node->displaced = false;",
    ),
    Mutation(
        "firmware: an order in time is not believed for a slow link's",
        "node_slowest_link",
        "firmware/dspic/core/node.h",
        "#define NODE_ORDER_MOST_US 70u",
        "#define NODE_ORDER_MOST_US 48u",
    ),
    Mutation(
        "firmware: both records packed into one buffer",
        "node_storm",
        "firmware/dspic/core/node.c",
        "    node->armed ^= 1u;\n",
        "",
    ),
    Mutation(
        "firmware: faults are counted twice",
        "test_node_faults",
        "firmware/dspic/core/node.c",
        "node->health[fault]++;",
        "node->health[fault] += 2u;",
    ),
    Mutation(
        "firmware: the build links both sensors' decoders",
        "tests/repository/test_firmware_tools.py",
        "tools/firmware/build.sh",
        "*/sensor_frame*.c) ;;",
        "*/none.c) ;;",
    ),
    Mutation(
        "firmware: the watchdog is never switched on",
        "test_node_faults",
        "firmware/dspic/port_dspic/dspic33fj128mc802.h",
        "#define RCON_SWDTEN 0x0020u",
        "#define RCON_SWDTEN 0x0000u",
    ),
    Mutation(
        "loader: an image's body is believed unread",
        "test_image",
        "firmware/dspic/boot/image.c",
        "           image_body_is_good(board, header, row);",
        "           row;",
    ),
    Mutation(
        "loader: a loaded body is not compared",
        "test_loader",
        "firmware/dspic/boot/loader.c",
        "if (!image_body_is_good(loader->board, loader->header, loader->row))",
        "if (!loader)",
    ),
    Mutation(
        "bridge: two lanes swapped",
        "fpga/tb/lanes",
        "fpga/bridge_rtl/lane_receiver.v",
        "<= miso;",
        "<= {miso[LANES-1:2], miso[0], miso[1]};",
    ),
    Mutation(
        "bridge: a sequence number dropped every 4096 frames",
        "fpga/tb/ticks",
        "fpga/bridge_rtl/bridge_counters.v",
        "sequence_number <= sequence_number + 32'd1;",
        "sequence_number <= sequence_number + (&sequence_number[11:0] ? 32'd2 : 32'd1);",
    ),
    Mutation(
        "bridge: stale records pass",
        "fpga/tb/frame",
        "fpga/bridge_rtl/framer.v",
        "stale   <= tick_wrong;",
        "stale   <= {LANES{1'b0}};",
    ),
    Mutation(
        "bridge: order without its CRC",
        "fpga/tb/link",
        "fpga/bridge_rtl/node_link.v",
        "crc[7] ^ CRC8_XOR_OUT[{2'b00, ~next_index[2:0]}]",
        "crc[7]",
    ),
    Mutation(
        "usb: data toggle kept over a bus reset",
        "fpga/tb/usb",
        "fpga/usb/endpoints.py",
        '= ResetInserter({"usb": self.restart})(inner)',
        "= inner",
    ),
    Mutation(
        "bridge: a tick judged by its last bit",
        "fpga/tb/link",
        "fpga/bridge_rtl/lane_receiver.v",
        "tick_wrong <= tick_wrong | (bits ^ {LANES{tick[7]}});",
        "tick_wrong <= bits ^ {LANES{tick[7]}};",
    ),
    Mutation(
        "bridge: a tick judged without its first bit",
        "fpga/tb/link",
        "fpga/bridge_rtl/lane_receiver.v",
        "tick_wrong <= tick_wrong | (bits ^ {LANES{tick[7]}});",
        "tick_wrong <= tick_wrong | ((bits ^ {LANES{tick[7]}}) & {LANES{|bits_index[2:0]}});",
    ),
    Mutation(
        "bridge: a lane is absent by its last bit",
        "fpga/tb/link",
        "fpga/bridge_rtl/lane_receiver.v",
        "absent <= absent & bits;",
        "absent <= bits;",
    ),
    Mutation(
        "bridge: room for a frame less",
        "fpga/tb/frame",
        "fpga/bridge_rtl/frame_fifo.v",
        "(used <= DEPTH - FRAME)",
        "(used < DEPTH - FRAME)",
    ),
    Mutation(
        "bridge: room for 63 frames",
        "fpga/tb/frame",
        "fpga/bridge_rtl/frame_fifo.v",
        "DEPTH = {1'b1, {ADDRESS_BITS{1'b0}}};",
        "DEPTH = {1'b1, {ADDRESS_BITS{1'b0}}} - FRAME;",
    ),
    Mutation(
        "bridge: a frame needs a byte less than it has",
        "fpga/tb/frame",
        "fpga/bridge_rtl/frame_fifo.v",
        "FRAME = FRAME_BYTES[ADDRESS_BITS:0];",
        "FRAME = FRAME_BYTES[ADDRESS_BITS:0] - 1;",
    ),
    Mutation(
        "bridge: good and bad records exchanged",
        "fpga/tb/frame",
        "fpga/bridge_rtl/framer.v",
        "accepted    = (record_code == CODE_OK[5:0]);",
        "accepted    = (record_code != CODE_OK[5:0]);",
    ),
    Mutation(
        "bridge: the last frame is not kept",
        "fpga/tb/frame",
        "fpga/bridge_rtl/framer.v",
        "out_keep <= is_last;",
        "out_keep <= 1'b0;",
    ),
    Mutation(
        "bridge: absent reported as link_crc",
        "fpga/tb/frame",
        "fpga/bridge_rtl/framer.v",
        "gone[0] ? CODE_ABSENT[5:0]",
        "gone[0] ? CODE_LINK_CRC[5:0]",
    ),
    Mutation(
        "bridge: an absent lane's answer reported as link_crc",
        "fpga/tb/stores",
        "fpga/bridge_rtl/answer_store.v",
        "is_gone[lane] ? CODE_ABSENT[5:0]",
        "is_gone[lane] ? CODE_LINK_CRC[5:0]",
    ),
    Mutation(
        "bridge: stale answers pass",
        "fpga/tb/stores",
        "fpga/bridge_rtl/answer_store.v",
        "stale   <= tick_wrong;",
        "stale   <= {LANES{1'b0}};",
    ),
    Mutation(
        "bridge: CRC not cleared between records",
        "fpga/tb/frame",
        "fpga/bridge_rtl/framer.v",
        ".clear(start || (make && at_crc))",
        ".clear(start)",
    ),
    Mutation(
        "bridge: every byte of the header marked as the first",
        "fpga/tb/frame",
        "fpga/bridge_rtl/framer.v",
        "in_header && (at_byte == 5'd0);",
        "in_header;",
    ),
    Mutation(
        "bridge: select held a cycle less",
        "fpga/tb/link",
        "fpga/bridge_rtl/node_link.v",
        "HOLD_CYCLES  = 8'd4;",
        "HOLD_CYCLES  = 8'd3;",
    ),
    Mutation(
        "bridge: select set up a cycle less",
        "fpga/tb/link",
        "fpga/bridge_rtl/node_link.v",
        "SETUP_CYCLES = 8'd9;",
        "SETUP_CYCLES = 8'd8;",
    ),
    Mutation(
        "board: op_mode and xcvr_select crossed",
        "test_boards",
        "fpga/boards/board_core.v",
        ".utmi_xcvr_select(xcvr_select), .utmi_term_select(term_select), .utmi_op_mode(op_mode),\n",
        ".utmi_xcvr_select(op_mode), .utmi_term_select(term_select), .utmi_op_mode(xcvr_select),\n",
    ),
    Mutation(
        "board: the PHY held in reset",
        "test_boards",
        "fpga/boards/cynthion.v",
        "assign ulpi_reset_n = !ulpi_reset;",
        "assign ulpi_reset_n = ulpi_reset;",
    ),
    Mutation(
        "board: the PHY's polarity as it was",
        "test_boards",
        "fpga/boards/cynthion.v",
        "PHY_SWAPPED  = 8'h06;",
        "PHY_SWAPPED  = 8'h04;",
    ),
    Mutation(
        "board: pads let go when they are to drive",
        "test_boards",
        "fpga/boards/ulpi_pads.v",
        "LUT4 #(.INIT(16'hEEEE)) either",
        "LUT4 #(.INIT(16'h1111)) either",
    ),
    Mutation(
        "board: a pad that drives while DIR falls",
        "test_boards",
        "fpga/boards/ulpi_pads.v",
        "LUT4 #(.INIT(16'hEEEE)) either",
        "LUT4 #(.INIT(16'hCCCC)) either",
    ),
    Mutation(
        "board: a PHY whose clock hangs is left alone",
        "test_boards",
        "fpga/boards/phy_watch.v",
        "phy_reset <= !alive && lost && silent > LATE;",
        "phy_reset <= 1'b0;",
    ),
    Mutation(
        "board: two MISO pins swapped",
        "fpga/boards/test_boards.py",
        "fpga/boards/ecpix5.toml",
        '"U23", "V23"',
        '"V23", "U23"',
    ),
    Mutation(
        "usb: the toggle outlives CLEAR_FEATURE(HALT)",
        "fpga/tb/usb",
        "fpga/usb/endpoints.py",
        "bus.clear_endpoint_halt_in.enable.eq(self.unhalt)",
        "bus.clear_endpoint_halt_in.enable.eq(0)",
    ),
    Mutation(
        "usb: a halt outlives a reset",
        "fpga/tb/usb",
        "fpga/usb/endpoints.py",
        "with m.If(self.restart | self.unhalt):",
        "with m.If(self.unhalt):",
    ),
    Mutation(
        "host: alpha read where beta stands",
        "test_frame",
        "host/libwhisker/src/frame.c",
        "sample->beta = whisker_get_u16(record + WHISKER_RECORD_BETA);",
        "sample->beta = sample->alpha;",
    ),
    Mutation(
        "host: lanes stored from the wrong end",
        "test_frame",
        "host/libwhisker/src/frame.c",
        "&frame->lane[lane], damage);",
        "&frame->lane[WHISKER_FRAME_LANES - 1 - lane], damage);",
    ),
    Mutation(
        "pilot: bad samples used",
        "host/python/tests/pilot/test_pilot.py",
        "host/python/crunchbot/pilot/pilot.py",
        "good = len(self.names), np.asarray(status)[:, : len(self.names)] == 0",
        "good = len(self.names), np.asarray(status)[:, : len(self.names)] >= 0",
    ),
    Mutation(
        "navigation: motion turned the wrong way",
        "nav_test_motion",
        "host/nav/problem/pose.c",
        "sin(",
        "-sin(",
    ),
    Mutation(
        "base: a frame is believed without its sum",
        "test_oi_stream",
        "host/create/src/stream.c",
        "if (!stream_sum_is_right(stream)) {",
        "if (!stream_sum_is_right(stream) && stream->count == 0) {",
    ),
    Mutation(
        "base: a damaged frame takes the next one's beginning with it",
        "test_oi_stream",
        "host/create/src/stream.c",
        "size_t from = 1;",
        "size_t from = stream->count;",
    ),
    Mutation(
        "base: encoders do not wrap",
        "test_oi_odometry",
        "host/create/src/odometry.c",
        "return (int16_t)(uint16_t)(now - before);",
        "return now - before;",
    ),
    Mutation(
        "base: a slow turn that carries no information counts against kept remainders",
        "sim_create.remainder",
        "host/create/src/remainder.c",
        "    if (reported > 0) {",
        "    if (reported >= 0) {",
    ),
    Mutation(
        "base: one stray number decides",
        "test_oi_remainder",
        "host/create/src/remainder.c",
        "#define STRAY 0.01",
        "#define STRAY 1e-9",
    ),
    Mutation(
        "base: evidence of remainders does not outlast an interruption",
        "test_oi_remainder",
        "host/create/src/remainder.c",
        "    evidence->settled = same ?",
        "    evidence->against_kept = same ? evidence->against_kept : 0;\n    evidence->settled = same ?",
    ),
    Mutation(
        "base: a held turn is not noticed",
        "test_oi_standing",
        "host/create/src/odometry.c",
        "reported, odometry->remainder == CREATE_KEPT);",
        "reported, odometry->remainder == CREATE_DROPPED);",
    ),
    Mutation(
        "base: orders of a body that stands are integrated",
        "test_oi_standing",
        "host/create/src/odometry.c",
        "odometry->standing == CREATE_STANDS;\n    return reported",
        "odometry->standing > CREATE_CANNOT_TELL;\n    return reported",
    ),
    Mutation(
        "base: a stop does not end half an order before it",
        "test_oi_command",
        "host/create/src/command.c",
        "    memset(bytes, 0, PADDING);\n    return PADDING + create_put_drive_direct(bytes + PADDING, 0, 0);",
        "    return create_put_drive_direct(bytes, 0, 0);",
    ),
    Mutation(
        "ring: frames overwritten while they were read are taken for whole",
        "test_ring",
        "host/libwhisker/src/ring/ring_reader.c",
        "- index > reader->map.capacity;",
        "- index > 2 * reader->map.capacity;",
    ),
    Mutation(
        "ring: missing sequence numbers are not counted",
        "test_ring",
        "host/libwhisker/src/ring/ring_reader.c",
        "reader->frames_missing += missing;",
        "reader->frames_missing += 0;",
    ),
    Mutation(
        "ring: pages are left to fault under the samples",
        "test_no_allocation",
        "host/libwhisker/src/ring/ring_map.c",
        "MAP_SHARED | MAP_FIXED | MAP_POPULATE",
        "MAP_SHARED | MAP_FIXED",
    ),
    Mutation(
        "ring: a writer takes the name of one that lives",
        "test_ring",
        "host/libwhisker/src/ring/ring_file.c",
        "return ring_file_is_locked(fd, RING_LOCK_WRITER) ? WHISKER_ERROR_RING_BUSY : WHISKER_OK;",
        "return WHISKER_OK;",
    ),
    Mutation(
        "ring: the ring of any user is read",
        "test_ring_trust",
        "host/libwhisker/src/ring/ring_file.c",
        "return owner == 0 || owner == geteuid()",
        "return true || owner == geteuid()",
    ),
    Mutation(
        "ring: a signal to any process that has the ring open",
        "test_ring_trust",
        "host/libwhisker/src/ring/ring_signal.c",
        "is_ring && ring_signal_holds_lock(pid, entry->d_name)",
        "is_ring && (ring_signal_holds_lock(pid, entry->d_name) || true)",
    ),
    Mutation(
        "ring: a file with holes is mapped",
        "test_ring_hostile",
        "host/libwhisker/src/ring/ring_map.c",
        "return !error && ring_map_has_holes(file)",
        "return !error && ring_map_has_holes(file) && false",
    ),
    Mutation(
        "ring: a link is followed",
        "test_ring_hostile",
        "host/libwhisker/src/ring/ring_file.c",
        "O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK",
        "O_RDONLY | O_CLOEXEC | O_NONBLOCK",
    ),
    Mutation(
        "ring: another layout version is read all the same",
        "test_ring_hostile",
        "host/libwhisker/src/ring/ring_map.c",
        "if (header->version != RING_LAYOUT_VERSION) {",
        "if (header->version < RING_LAYOUT_VERSION) {",
    ),
    Mutation(
        "recording: frames that were not read in time are not reported",
        "host/python/tests/recording/test_recording.py",
        "host/python/crunchbot/recording/recorder.py",
        "self._lost += overrun - self._overrun",
        "self._lost += 0",
    ),
    Mutation(
        "recording: a replay drops each piece's last frame",
        "host/python/tests/recording/test_recording.py",
        "host/python/crunchbot/recording/replay.py",
        "self._writer.publish(run)",
        "self._writer.publish(run[:-1])",
    ),
    Mutation(
        "view: a foreign page is answered",
        "host/python/tests/view/test_view_http.py",
        "host/python/crunchbot/view/guard.py",
        'if origin is not None and origin.lower() != f"http://{host.lower()}":',
        "if origin is not None and not origin:",
    ),
    Mutation(
        "base: the beginning of a message too long is obeyed",
        "host/python/tests/pilot/test_base.py",
        "host/apps/whisker_base/whisker_base_clients.c",
        "if ((size_t)got >= sizeof client->message) {",
        "if ((size_t)got >= 64 * sizeof client->message) {",
    ),
    Mutation(
        "base: a silent commander's order goes on",
        "host/python/tests/pilot/test_base.py",
        "host/apps/whisker_base/whisker_base_robot.c",
        "if (whisker_base_robot_moving(robot) && now_ms - robot->drive_ms >= BASE_COMMANDER_MS) {",
        "if (whisker_base_robot_moving(robot) && now_ms - robot->drive_ms >= 1000 * BASE_COMMANDER_MS) {",
    ),
    Mutation(
        "base: the guard leaves the wheels of a dead driver turning",
        "host/python/tests/pilot/test_base.py",
        "host/apps/whisker_base/whisker_base_guard.c",
        "    if (!WIFEXITED(status)) {\n        whisker_base_guard_stop_wheels(guard);",
        "    if (status < 0) {\n        whisker_base_guard_stop_wheels(guard);",
    ),
    Mutation(
        "base: a base that fell silent is driven blind",
        "host/python/tests/pilot/test_base.py",
        "host/apps/whisker_base/whisker_base_robot.c",
        "robot->silent = robot->stream.counts.frames > 0;",
        "robot->silent = false;",
    ),
    Mutation(
        "base: a stop ordered in a silence is not counted",
        "test_base_silence",
        "host/apps/whisker_base/whisker_base_robot.c",
        "speeds.left_mm_s != before.left_mm_s || speeds.right_mm_s != before.right_mm_s",
        "speeds.left_mm_s > before.left_mm_s || speeds.right_mm_s > before.right_mm_s",
    ),
    Mutation(
        "emulator: remainders are kept whatever the option says",
        "sim_create.sensors",
        "sim/create/sensors.c",
        "create->options.drop_remainder ? now :",
        "create->options.drop_remainder ? *read + whole / factor :",
    ),
    Mutation(
        "emulator: safe mode drives over a cliff",
        "sim_create.modes",
        "sim/create/modes.c",
        "create->stimuli & CLIFFS && modes_toward_cliff(create)",
        "create->stimuli & CLIFFS && !modes_toward_cliff(create)",
    ),
    Mutation(
        "emulator: a frame too long for its period is sent whole",
        "sim_create.stream",
        "sim/create/serial_line.c",
        "if (line->frame > 0)",
        "if (line->frame > QUEUE_MAX)",
    ),
    Mutation(
        "network: messages that never came are not counted",
        "host/python/tests/robot/test_robot_link.py",
        "host/python/crunchbot/robot/network/streams.py",
        "self.missed += max(0, envelope.number - self.next - self.refused_since)",
        "self.missed += 0",
    ),
    Mutation(
        "network: a message that comes again counts twice",
        "host/python/tests/robot/test_robot_link.py",
        "host/python/crunchbot/robot/network/streams.py",
        "return envelope.number < self.next",
        "return envelope.number + 1 < self.next",
    ),
    Mutation(
        "network: another release's messages are believed",
        "host/python/tests/robot/test_robot_link.py",
        "host/python/crunchbot/robot/network/streams.py",
        "if version != VERSION:",
        "if version < 0:",
    ),
    Mutation(
        "network: motion of rows that never came is lost",
        "host/python/tests/robot/test_robot_rows.py",
        "host/python/crunchbot/robot/network/rows.py",
        "motion = row.motion if rows == 1 else between(last.pose, row.pose)",
        "motion = row.motion",
    ),
    Mutation(
        "network: a navigator that joins late believes the run's start",
        "host/python/tests/robot/test_robot_navigator.py",
        "host/python/crunchbot/robot/navigator.py",
        "or self._follower.first_seq > 0",
        "or self._follower.first_seq < 0",
    ),
    Mutation(
        "network: motion of missed rows comes in one",
        "host/python/tests/robot/test_robot_rows.py",
        "host/python/crunchbot/robot/network/rows.py",
        "within_ns = t_ns - before_ns if known else 0",
        "within_ns = 0",
    ),
    Mutation(
        "base: a silent base is taken to drive on after it was stopped",
        "test_oi_odometry",
        "host/create/src/odometry.c",
        "before = stands ? 0 : frame->missed - frame->ordered;",
        "before = stands ? 0 : frame->missed;",
    ),
    Mutation(
        "pilot: ticks that never came are good samples",
        "host/python/tests/robot/test_robot_blocks.py",
        "host/python/crunchbot/robot/blocks.py",
        'self._block["status"] = LOST',
        'self._block["status"] = 0',
    ),
    Mutation(
        "pilot: drives on without word from the base",
        "host/python/tests/pilot/test_pilot_rules.py",
        "host/python/crunchbot/pilot/conditions.py",
        "return b.bumps.adrift or (b.heard >= 0 and tick - b.heard > LOST_TICKS)",
        "return b.bumps.adrift",
    ),
    Mutation(
        "pilot: a cliff does not stop it",
        "host/python/tests/pilot/test_pilot_rules.py",
        "host/python/crunchbot/pilot/conditions.py",
        "return b.bumps.cliff and b.state not in",
        "return b.bumps.cliff and b.state in",
    ),
    Mutation(
        "pilot: the push lasts from its block's end, not from the onset",
        "host/python/tests/pilot/test_pilot_behaviour.py",
        "host/python/crunchbot/pilot/conditions.py",
        "return tick >= contact.onset + b.wheels.push_ticks or",
        "return tick >= b.since + b.wheels.push_ticks or",
    ),
    Mutation(
        "pilot: a blocked body is not felt in odometry",
        "host/python/tests/pilot/test_pilot_behaviour.py",
        "host/python/crunchbot/pilot/behaviour.py",
        "self.stuck = self.stuck + 1 if blocked else 0",
        "self.stuck = 0",
    ),
    Mutation(
        "pilot: searches on the wrong side first",
        "host/python/tests/pilot/test_pilot_behaviour.py",
        "host/python/crunchbot/pilot/effects.py",
        "b.whisk = Whisk(lane, b.first_turn[lane])",
        "b.whisk = Whisk(lane, -b.first_turn[lane])",
    ),
]


def run(words: list, where: Path) -> subprocess.CompletedProcess:
    return subprocess.run([str(word) for word in words], cwd=where, capture_output=True, text=True)


def prepare(copy: Path) -> None:
    """A clone with the packages of this tree, built once; mutations then build only what they touch."""
    if not copy.exists():
        run(["git", "clone", "--quiet", ROOT, copy], ROOT)
        (copy / ".venv").symlink_to(ROOT / ".venv")
    done = run(["tools/build.sh", BUILD], copy)
    if done.returncode:
        sys.exit(f"mutations: the unbroken tree does not build; run 'make build' and see\n{done.stderr[-2000:]}")


def run_pytest(copy: Path, *paths: str) -> str | None:
    """The first test of these that fails, or None."""
    environment = [f"PYTHONPATH={copy / 'host/python'}", f"WHISKER_BUILD={BUILD}"]
    done = run(["env", *environment, ".venv/bin/python", "-m", "pytest", "-x", "--no-header", *paths], copy)
    return _failed(done.stdout, "FAILED", "ERROR") if done.returncode else None


def run_ctest(copy: Path, *options: str) -> str | None:
    done = run(["ctest", "--test-dir", BUILD, "--no-tests=error", *options], copy)
    return _failed(done.stdout, "***") if done.returncode else None


def build_program(copy: Path, program: str) -> bool:
    built = run(["cmake", "--build", BUILD, "--target", program], copy)
    if "unknown target" in built.stdout + built.stderr:
        sys.exit(f"mutations: there is no program {program}; bring the list up to date")
    return built.returncode == 0


def red_nearby(copy: Path, near: str) -> str | None:
    """What the test that ought to notice says, or None; only what it needs is built."""
    program = PROGRAMS.get(near, "" if "/" in near else near)
    if program and not build_program(copy, program):
        return "does not build"
    if "/" in near:
        return run_pytest(copy, near)
    return run_ctest(copy, "-R", f"(^|[_.]){near.removeprefix('test_')}$")


def first_red(copy: Path) -> str | None:
    """The first check of all that notices, or None."""
    if run(["tools/build.sh", BUILD], copy).returncode:
        return "does not build"
    red = run_ctest(copy, "--parallel", "2", "--stop-on-failure")
    return red or run_pytest(copy, "host/python", "sim", "fpga/tb", "tests")


def _failed(output: str, *marks: str) -> str:
    return next((" ".join(line.split()) for line in output.splitlines() if any(m in line for m in marks)), "red")


def try_one(copy: Path, mutation: Mutation, only_near: bool) -> bool:
    """Breaks, tests, mends. True when a test was red."""
    path = copy / mutation.file
    text = path.read_text()
    if text.count(mutation.old) == 0:
        print(f"STALE     {mutation.name}: {mutation.file} does not hold '{mutation.old}'", flush=True)
        return False
    path.write_text(text.replace(mutation.old, mutation.new, 1))
    red = red_nearby(copy, mutation.near) or (None if only_near else first_red(copy))
    path.write_text(text)
    print(f"{'red ' if red else 'SURVIVES'}  {mutation.name}: {red or 'no test noticed'}", flush=True)
    return red is not None


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="?", default="", help="only mutations whose name contains this")
    parser.add_argument("--near", action="store_true", help="only the test that ought to notice first")
    parser.add_argument("--copy", type=Path, help="a copy of the tree that is kept")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        copy = options.copy.resolve() if options.copy else Path(folder) / "tree"
        prepare(copy)
        found = [try_one(copy, m, options.near) for m in MUTATIONS if options.part in m.name]
    return 0 if all(found) else 1


if __name__ == "__main__":
    sys.exit(main())
