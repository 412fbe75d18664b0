#include "cli/real_time.h"

#include <spdlog/spdlog.h>

namespace sinerig::cli {

std::unique_ptr<realtime::LoopThread> make_loop_thread(const config::Rig& rig) {
  if (rig.clock == config::ClockKind::virtual_time) return std::make_unique<realtime::LoopThread>();
  auto thread = std::make_unique<realtime::LoopThread>(rig.realtime);
  const std::string missing = realtime::describe_missing(thread->grants(), "  ");
  if (missing.empty()) return thread;
  if (rig.require_realtime)
    rig.file->section("loop").refuse("require_realtime", "this machine does not grant:" + missing);
  spdlog::warn("the loop runs without real-time rights that `sinerig doctor {}` says more of:{}",
               rig.file->name(), missing);
  return thread;
}

void record_grants(record::SweepWriter& writer, const realtime::Grants& grants) {
  for (const realtime::Grant& grant : grants)
    writer.set(std::string{"realtime_"} + realtime::to_string(grant.right),
               (grant.granted ? "" : "missing: ") + grant.state);
}

}  // namespace sinerig::cli
