#include "dashboard/live_run.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "dashboard/live_json.h"
#include "dashboard/token.h"
#include "record/stored_point.h"
#include "report/report_data.h"

namespace sinerig::dashboard {

namespace {

using report::rounded;

// Entries in one message: some 100 kB.
constexpr std::size_t most_in_message = 256;

// A flood of gaps or faults is counted by the loop; a page needs no more of them than this.
constexpr std::size_t most_events = 2000;

std::vector<std::string> names_of(const record::StoredRun& run) {
  std::vector<std::string> names;
  for (const record::ChannelInfo& channel : run.channels) names.push_back(channel.name);
  return names;
}

std::vector<std::string> units_of(const record::StoredRun& run) {
  std::vector<std::string> units;
  for (const record::ChannelInfo& channel : run.channels) units.push_back(channel.unit);
  return units;
}

// Two cycles of this are two of the slowest tone.
double lowest_hz(const Dwell& dwell, double rate_hz) {
  double lowest = dwell.frequency_hz(rate_hz);
  for (const Tone& tone : dwell.tones) lowest = std::min(lowest, dwell.tone_hz(tone, rate_hz));
  return lowest;
}

}  // namespace

// What status() needs, copied while the lock is held, turned into text after.
struct LiveRun::Moment {
  Whereabouts::Kind kind{};
  std::uint32_t dwell_number = 0;
  std::optional<Dwell> dwell;
  double amplitude = 0.0;
  std::uint32_t retries = 0;
  double dwell_s = 0.0;
  double elapsed_s = 0.0;
  double remaining_s = 0.0;
  double done = 0.0;
  std::vector<Headroom> headroom;
  Scope::Trace trace;
  std::vector<std::vector<std::optional<RunningEstimate::Value>>> estimates;
};

LiveRun::LiveRun(LiveSetup setup, const Lateness& lateness)
    : setup_{std::move(setup)},
      lateness_{lateness},
      id_{random_token()},
      head_{std::make_shared<const std::string>(
          text_of(head_json(setup_.label, setup_.run, id_, setup_.in_real_time)))},
      where_{setup_.run.plan, setup_.preflight},
      scope_{setup_.run.channels.size(), setup_.limits, names_of(setup_.run), units_of(setup_.run),
             setup_.run.plan.rate_hz},
      estimates_(setup_.run.responses.size()),
      time_{setup_.run.plan} {}

LiveRun::~LiveRun() = default;

// Signals and estimates of what was before are forgotten.
void LiveRun::begin_part() {
  const SweepPlan& plan = setup_.run.plan;
  const Dwell* dwell = where_.under_way();
  if (dwell != nullptr) {
    scope_.start(lowest_hz(*dwell, plan.rate_hz));
  } else if (where_.kind() == Whereabouts::Kind::probe) {
    scope_.start(plan.probe.low_hz);
  }
  const std::size_t tones = dwell != nullptr ? dwell->tones.size() : 1;
  for (std::size_t i = 0; i < estimates_.size(); ++i) {
    const record::StoredResponse& response = setup_.run.responses[i];
    estimates_[i].clear();
    for (std::size_t tone = 0; tone < tones; ++tone) {
      estimates_[i].emplace_back(static_cast<std::uint16_t>(response.input),
                                 static_cast<std::uint16_t>(response.output),
                                 static_cast<std::uint16_t>(tone));
    }
  }
}

void LiveRun::resume(const FinishedDwells& finished) {
  const std::scoped_lock lock{mutex_};
  for (const std::uint32_t candidate : finished.refined) where_.add(candidate);
  entries_.insert(entries_.end(), finished.points.begin(), finished.points.end());
}

void LiveRun::take(const Record& record) {
  const std::scoped_lock lock{mutex_};
  if (where_.take(record)) begin_part();
  if (const auto* samples = std::get_if<TickSamples>(&record)) {
    scope_.add(*samples);
    time_.update(samples->dwell, samples->tick);
  } else if (const auto* block = std::get_if<Block>(&record)) {
    for (auto& tones : estimates_)
      for (RunningEstimate& estimate : tones) estimate.add(*block);
  } else if (const auto* event = std::get_if<Event>(&record)) {
    if (event->kind == EventKind::dwell_began) {
      time_.update(event->dwell, event->tick);
      return;
    }
    if (events_ < most_events || event->trip.tripped()) {
      entries_.push_back(record);
      ++events_;
    }
  } else {
    entries_.push_back(record);
  }
}

void LiveRun::finish(Ending ending) {
  const std::scoped_lock lock{mutex_};
  ending_ = std::make_unique<Ending>(std::move(ending));
}

Text LiveRun::log(std::size_t from, std::size_t& next) {
  std::vector<Record> entries;
  std::vector<Dwell> added;
  {
    const std::scoped_lock lock{mutex_};
    next = std::min(entries_.size(), from + most_in_message);
    if (from >= next) {
      next = from;
      return nullptr;
    }
    if (cached_ && cached_from_ == from && cached_next_ == next) return cached_;
    entries.assign(entries_.begin() + static_cast<std::ptrdiff_t>(from),
                   entries_.begin() + static_cast<std::ptrdiff_t>(next));
    added = where_.added();
  }
  cached_ = std::make_shared<const std::string>(text_of(log_json(entries, setup_.run, added)));
  cached_from_ = from;
  cached_next_ = next;
  return cached_;
}

LiveRun::Moment LiveRun::moment() {
  const std::scoped_lock lock{mutex_};
  Moment moment{.kind = where_.kind(),
                .dwell_number = where_.dwell(),
                .dwell = {},
                .amplitude = where_.amplitude(),
                .retries = where_.retries(),
                .dwell_s = where_.seconds(),
                .elapsed_s = time_.elapsed_s(),
                .remaining_s = time_.remaining_s(),
                .done = time_.done(),
                .headroom = scope_.headroom(),
                .trace = scope_.trace(),
                .estimates = {}};
  if (const Dwell* dwell = where_.under_way()) moment.dwell = *dwell;
  for (const auto& tones : estimates_) {
    moment.estimates.emplace_back();
    for (const RunningEstimate& estimate : tones)
      moment.estimates.back().push_back(estimate.value());
  }
  return moment;
}

Text LiveRun::status() {
  const Moment now = moment();
  const SweepPlan& plan = setup_.run.plan;
  // Nobody knows how many more will be added.
  const bool more =
      now.kind == Whereabouts::Kind::refined || now.kind == Whereabouts::Kind::remeasured;
  Json json{{"dwell", now.dwell_number},
            {"kind", to_string(now.kind)},
            {"amplitude", rounded(now.amplitude, 5)},
            {"retries", now.retries},
            {"elapsed_s", rounded(now.elapsed_s, 7)},
            {"remaining_s", more ? Json{} : rounded(now.remaining_s, 5)},
            {"done", rounded(now.done, 5)},
            {"dwell_s", rounded(now.dwell_s, 5)},
            {"late_us", rounded(1e-3 * static_cast<double>(lateness_.last_ns.load()), 4)},
            {"late_max_us", rounded(1e-3 * static_cast<double>(lateness_.max_ns.load()), 4)},
            {"skipped", lateness_.skipped.load()},
            {"stop_requests", setup_.stop_requests ? setup_.stop_requests() : 0}};
  if (now.dwell) {
    json["hz"] = Json::array();
    for (const Tone& tone : now.dwell->tones)
      json["hz"].push_back(rounded(now.dwell->tone_hz(tone, plan.rate_hz), 9));
    json["waiting"] = now.dwell_s * plan.rate_hz < static_cast<double>(now.dwell->settle_samples);
    json["dwell_most_s"] = rounded(static_cast<double>(now.dwell->max_samples) / plan.rate_hz, 5);
  }
  json["headroom"] = headroom_json(now.headroom);
  json["trace"] = trace_json(now.trace);
  json["estimates"] = Json::array();
  for (const auto& tones : now.estimates) {
    Json each = Json::array();
    for (const auto& estimate : tones) each.push_back(estimate_json(estimate));
    json["estimates"].push_back(std::move(each));
  }
  return std::make_shared<const std::string>(text_of(json));
}

Text LiveRun::ending() {
  const std::scoped_lock lock{mutex_};
  if (!ending_) return nullptr;
  const std::string words =
      ending_->detail.empty() ? ending_->outcome : ending_->outcome + ": " + ending_->detail;
  return std::make_shared<const std::string>(
      text_of({{"outcome", ending_->outcome}, {"outcome_text", words}, {"files", ending_->files}}));
}

}  // namespace sinerig::dashboard
