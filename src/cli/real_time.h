// The loop's thread as a rig file wants it.
#pragma once

#include <memory>

#include "config/rig.h"
#include "realtime/loop_thread.h"
#include "record/sweep_writer.h"

namespace sinerig::cli {

// With real-time rights where the rig runs on the monotonic clock. What is missing is a warning, or
// with [loop] require_realtime a config::ConfigError that names each and what to do.
std::unique_ptr<realtime::LoopThread> make_loop_thread(const config::Rig& rig);

// The facts realtime_… of the sweep file: what was granted, and why the rest was not.
void record_grants(record::SweepWriter& writer, const realtime::Grants& grants);

}  // namespace sinerig::cli
