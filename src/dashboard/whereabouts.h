// Which part of a sweep is under way, from the records of the loop: a dwell of the plan, one that
// was added or is repeated, or what comes before the dwells.
#pragma once

#include <cstdint>
#include <vector>

#include "sweep/plan.h"
#include "sweep/records.h"

namespace sinerig::dashboard {

class Whereabouts {
 public:
  enum class Kind : std::uint8_t {
    waiting,     // for the first tick
    preflight,   // the first dwell at a part of its amplitude, see Preflight
    probe,       // the pass in which the modes are found
    planned,     // a dwell of the plan
    refined,     // a dwell that refinement has added
    remeasured,  // a dwell once more, without the model that turned out wrong
    closing,     // back to neutral
  };

  // `plan` must outlive it.
  Whereabouts(const SweepPlan& plan, bool preflight) : plan_{plan}, preflight_{preflight} {}

  // Of the plan's refinement: was added before the run was resumed.
  void add(std::uint32_t candidate);
  // Every record, in order. True where something begins: what was seen before belongs to another
  // part.
  bool take(const Record& record);

  Kind kind() const { return kind_; }
  std::uint32_t dwell() const { return dwell_; }  // index; from the plan's size on those added
  // Null where none is under way.
  const Dwell* under_way() const;
  double amplitude() const { return amplitude_; }  // asked for, of its first tone; 0: not known
  std::uint32_t retries() const { return retries_; }
  double seconds() const;  // since it began, this try

  // The dwells that have been added, the first of them following those of the plan.
  const std::vector<Dwell>& added() const { return added_; }

 private:
  bool begin(Kind kind, std::uint64_t tick);
  bool take_event(const Event& event);
  bool take_samples(const TickSamples& samples);
  const Dwell* dwell_at(std::uint32_t index) const;

  const SweepPlan& plan_;
  bool preflight_;
  std::vector<Dwell> added_;
  Kind kind_ = Kind::waiting;
  bool open_ = false;  // a dwell has begun and not ended
  std::uint32_t dwell_ = 0;
  std::uint32_t remeasured_ = no_dwell;
  double amplitude_ = 0.0;
  std::uint32_t retries_ = 0;
  std::uint64_t began_tick_ = 0;
  std::uint64_t tick_ = 0;

  static constexpr std::uint32_t no_dwell = 0xFFFF'FFFFU;
};

// "probe", "refined" …
const char* to_string(Whereabouts::Kind kind) noexcept;

}  // namespace sinerig::dashboard
