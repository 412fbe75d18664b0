#include "dashboard/whereabouts.h"

namespace sinerig::dashboard {

const Dwell* Whereabouts::dwell_at(std::uint32_t index) const {
  if (index < plan_.dwells.size()) return &plan_.dwells[index];
  const std::size_t added = index - plan_.dwells.size();
  return added < added_.size() ? &added_[added] : nullptr;
}

const Dwell* Whereabouts::under_way() const {
  const bool between = kind_ == Kind::waiting || kind_ == Kind::probe || kind_ == Kind::closing;
  return between ? nullptr : dwell_at(dwell_);
}

double Whereabouts::seconds() const {
  return tick_ > began_tick_ ? static_cast<double>(tick_ - began_tick_) / plan_.rate_hz : 0.0;
}

void Whereabouts::add(std::uint32_t candidate) {
  if (candidate >= plan_.refinement.candidates.size()) return;
  added_.push_back(plan_.refinement.candidates[candidate]);
}

bool Whereabouts::begin(Kind kind, std::uint64_t tick) {
  kind_ = kind;
  began_tick_ = tick_ = tick;
  return true;
}

bool Whereabouts::take_event(const Event& event) {
  if (event.kind == EventKind::refined) {
    add(event.candidate);
  } else if (event.kind == EventKind::remeasured) {
    remeasured_ = event.dwell;
  } else if (event.kind == EventKind::retried) {
    amplitude_ = event.value;
    ++retries_;
  } else if (event.kind == EventKind::dwell_began) {
    const bool same = event.dwell == dwell_ && (open_ || retries_ > 0);
    dwell_ = event.dwell;
    if (!same) {
      const Dwell* dwell = dwell_at(dwell_);
      amplitude_ = dwell != nullptr && !preflight_ ? dwell->tones.front().amplitude : 0.0;
      retries_ = 0;
    }
    open_ = true;
    return begin(preflight_                      ? Kind::preflight
                 : dwell_ == remeasured_         ? Kind::remeasured
                 : dwell_ >= plan_.dwells.size() ? Kind::refined
                                                 : Kind::planned,
                 event.tick);
  }
  return false;
}

// Where no dwell is open the loop probes, or takes the command back to neutral at the end.
bool Whereabouts::take_samples(const TickSamples& samples) {
  tick_ = samples.tick;
  if (open_) return false;
  const bool at_end = samples.dwell >= plan_.dwells.size() + added_.size();
  const Kind kind = at_end || plan_.probe.command.empty() ? Kind::closing : Kind::probe;
  return kind != kind_ && begin(kind, samples.tick);
}

bool Whereabouts::take(const Record& record) {
  if (const auto* samples = std::get_if<TickSamples>(&record)) return take_samples(*samples);
  if (const auto* event = std::get_if<Event>(&record)) return take_event(*event);
  if (std::holds_alternative<Preflight>(record)) {
    preflight_ = false;
    open_ = false;
  } else if (std::holds_alternative<DwellTiming>(record)) {
    open_ = false;
    retries_ = 0;
  }
  return false;
}

const char* to_string(Whereabouts::Kind kind) noexcept {
  switch (kind) {
    case Whereabouts::Kind::waiting: return "waiting";
    case Whereabouts::Kind::preflight: return "preflight";
    case Whereabouts::Kind::probe: return "probe";
    case Whereabouts::Kind::planned: return "planned";
    case Whereabouts::Kind::refined: return "refined";
    case Whereabouts::Kind::remeasured: return "remeasured";
    case Whereabouts::Kind::closing: return "closing";
  }
  return "";
}

}  // namespace sinerig::dashboard
