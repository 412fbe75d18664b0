#include "overnight_account.h"

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "sweep/records.h"

namespace sinerig::bench {

namespace {

// The ticks at which the guard must have tripped or ended a dwell for `planted`; none for what a
// sweep lives with.
std::pair<const char*, std::uint64_t> answer_to(const Planted& planted) {
  constexpr std::uint64_t age_ticks = 100;
  switch (planted.ill) {
    case Ill::drive_trips:
    case Ill::error_code: return {"tripped", planted.tick};
    case Ill::connection_lost: return {"tripped", planted.tick + 1};  // the second faulty write
    case Ill::sensor_dead: return {"tripped", planted.tick + age_ticks - 1};
    case Ill::bump:
    case Ill::hot: return {"limited", planted.tick};
    case Ill::gap: return {"gap", planted.tick};
    case Ill::command_lost: return {"actuator_fault", planted.tick};
  }
  return {"", 0};
}

}  // namespace

// Crosses each planted ill off against its event, then the consequences against their causes.
Account reconcile(const Night& night, const record::StoredRun& run) {
  std::map<std::string, std::vector<const record::StoredEvent*>> open;
  for (const record::StoredEvent& event : run.events) open[event.kind].push_back(&event);
  const auto take = [&](const std::string& kind, std::uint64_t tick, std::uint64_t slack,
                        std::uint32_t channel) {
    auto& events = open[kind];
    const auto found = std::find_if(events.begin(), events.end(), [&](const auto* event) {
      return event->tick >= tick && event->tick <= tick + slack &&
             (channel == 0 || event->channel == channel);
    });
    if (found == events.end()) return false;
    events.erase(found);
    return true;
  };
  Account account;
  // Every faulty write of a running loop is told of, the planted ones and the rig's own.
  for (const std::uint64_t tick : night.diary().faulty_writes) take("actuator_fault", tick, 0, 0);
  for (const Planted& planted : night.planted()) {
    if (!planted.met) continue;
    auto& [planned, answered] = account.answered[planted.ill];
    ++planned;
    const auto [kind, tick] = answer_to(planted);
    // A reading may be as old as its delay, and the age is counted from there.
    const std::uint64_t slack = planted.ill == Ill::sensor_dead ? 2 : 0;
    const bool found = planted.ill == Ill::command_lost
                           ? std::ranges::count(night.diary().faulty_writes, planted.tick) == 1 &&
                                 std::ranges::any_of(run.events,
                                                     [&](const record::StoredEvent& event) {
                                                       return event.kind == "actuator_fault" &&
                                                              event.tick == planted.tick;
                                                     })
                           : take(kind, tick, slack, 0);
    if (found) {
      ++answered;
      // One that outlasts the wait trips the guard again.
      while (planted.ill == Ill::sensor_dead && take(kind, tick, planted.ticks, 0)) {
      }
    } else {
      ++account.unanswered;
      std::printf("  unanswered: %s at tick %llu\n", to_string(planted.ill),
                  static_cast<unsigned long long>(planted.tick));
    }
  }
  for (const Diary::Reading& reading : night.diary().sensor_faults) {
    const auto channel = static_cast<std::uint32_t>(first_sensor_channel + reading.sensor);
    if (take("sensor_fault", reading.tick, 0, channel)) continue;
    ++account.unanswered;
    std::printf("  unanswered: reading of %s lost at tick %llu\n",
                run.channels[channel].name.c_str(), static_cast<unsigned long long>(reading.tick));
  }
  for (const char* kind : {"tripped", "limited", "gap", "actuator_fault", "sensor_fault"}) {
    for (const record::StoredEvent* event : open[kind]) {
      ++account.unexplained;
      std::printf("  unexplained: %s at tick %llu %s\n", kind,
                  static_cast<unsigned long long>(event->tick), event->detail.c_str());
    }
  }
  return account;
}

}  // namespace sinerig::bench
