// Keeps everything that leaves the loop, for tests to look at.
#pragma once

#include <vector>

#include "support/outside_the_loop.h"
#include "sweep/records.h"

namespace sinerig::test {

class CollectingSink final : public RecordSink {
 public:
  void put(const Record& record) noexcept override {
    const OutsideTheLoop noting_down;
    if (const auto* point = std::get_if<Point>(&record)) points.push_back(*point);
    if (const auto* block = std::get_if<Block>(&record)) blocks.push_back(*block);
    if (const auto* timing = std::get_if<DwellTiming>(&record)) timings.push_back(*timing);
    if (const auto* lesson = std::get_if<Lesson>(&record)) lessons.push_back(*lesson);
    if (const auto* event = std::get_if<Event>(&record)) events.push_back(*event);
    if (const auto* preflight = std::get_if<Preflight>(&record)) preflights.push_back(*preflight);
    if (const auto* note = std::get_if<Note>(&record)) notes.push_back(*note);
  }
  void put_sample(const TickSamples& tick) noexcept override {
    const OutsideTheLoop noting_down;
    samples.push_back(tick);
  }
  bool flush() noexcept override { return true; }

  std::vector<Point> points;
  std::vector<Block> blocks;
  std::vector<DwellTiming> timings;
  std::vector<Lesson> lessons;
  std::vector<Event> events;
  std::vector<Preflight> preflights;
  std::vector<Note> notes;
  std::vector<TickSamples> samples;
};

}  // namespace sinerig::test
