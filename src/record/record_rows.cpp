#include "record/record_rows.h"

#include <optional>

namespace sinerig::record {

namespace {

std::string placeholders(int count) {
  std::string text = "?";
  for (int i = 1; i < count; ++i) text += ", ?";
  return text;
}

std::string histogram_text(const DwellTiming& timing) {
  std::string text;
  for (const std::uint32_t count : timing.lateness) {
    if (!text.empty()) text += ' ';
    text += std::to_string(count);
  }
  return text;
}

}  // namespace

struct RecordRows::Statements {
  explicit Statements(Database& database)
      : run{database, "INSERT OR REPLACE INTO run VALUES (?, ?)"},
        // A dwell that was stopped midway is replaced by its repetition, all at once.
        point{database, "INSERT OR REPLACE INTO point VALUES (" + placeholders(26) + ")"},
        block{database, "INSERT INTO block VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)"},
        timing{database, "INSERT OR REPLACE INTO timing VALUES (" + placeholders(10) + ")"},
        event{database, "INSERT INTO event VALUES (NULL, ?, ?, ?, nullif(?, 0), ?, ?, ?)"},
        sample{database, "INSERT INTO sample VALUES (?, ?, ?)"},
        lesson{database, "INSERT OR REPLACE INTO lesson VALUES (" + placeholders(11) + ")"},
        durability{database, "INSERT OR REPLACE INTO durability VALUES (?, ?)"} {}

  Statement run;
  Statement point;
  Statement block;
  Statement timing;
  Statement event;
  Statement sample;
  Statement lesson;
  Statement durability;
};

RecordRows::RecordRows(Database& database, const RunInfo& info)
    : database_{database},
      candidates_{info.plan.refinement.candidates},
      statements_{std::make_unique<Statements>(database)} {
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    channel_names_.push_back(info.channels[i].name);
    if (i >= first_sensor_channel) sensor_names_.push_back(info.channels[i].name);
  }
}

RecordRows::~RecordRows() = default;

void RecordRows::begin_part(const PartStart& start) {
  start_ = start;
  attempts_.clear();
  Statement earlier{database_,
                    "SELECT dwell, 1 + max(attempt) FROM (SELECT dwell, attempt FROM block "
                    "UNION ALL SELECT dwell, attempt FROM lesson) GROUP BY dwell"};
  while (earlier.step()) {
    attempts_[static_cast<std::uint32_t>(earlier.integer(0))] =
        static_cast<std::uint32_t>(earlier.integer(1));
  }
}

void RecordRows::set(const std::string& key, const std::string& value) {
  statements_->run.bind(key, value).run();
}

void RecordRows::note_lag(std::uint32_t dwell, double lag_s) {
  statements_->durability.bind(dwell, lag_s).run();
}

void RecordRows::insert_dwell(std::size_t index, const Dwell& dwell) {
  Statement insert_dwell{database_, "INSERT INTO dwell VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  Statement insert_tone{database_, "INSERT INTO tone VALUES (?, ?, ?, ?, ?)"};
  insert_dwell
      .bind(index, dwell.asked_hz, dwell.block_samples, dwell.ramp_samples, dwell.settle_samples,
            dwell.blocks, dwell.max_samples, dwell.sub_band)
      .run();
  for (std::size_t k = 0; k < dwell.tones.size(); ++k) {
    const Tone& tone = dwell.tones[k];
    insert_tone.bind(index, k, tone.cycles, tone.amplitude, tone.phase_rad).run();
  }
}

void RecordRows::insert(const Record& record) {
  std::visit([this](const auto& each) { insert(each); }, record);
}

void RecordRows::insert(const Point& point) {
  statements_->point
      .bind(point.dwell, point.tone, point.pair, point.input, point.output, point.frequency_hz,
            point.response.real(), point.response.imag(), point.covariance.re_re,
            point.covariance.re_im, point.covariance.im_im, point.dof, point.gain_interval_db,
            point.phase_interval_deg, point.input_amplitude, point.output_amplitude, point.snr_db,
            point.distortion, point.drift_per_s, point.samples, point.lost, point.seconds,
            to_string(point.status), to_string(point.reason), point.reason_value,
            to_string(point.settled_by))
      .run();
}

void RecordRows::insert(const Block& block) {
  statements_->block
      .bind(block.dwell, attempt_of(block.dwell, block.attempt), block.block, block.tone,
            block.channel, start_.tick + block.first_tick, block.coefficients.a,
            block.coefficients.b, block.coefficients.mean)
      .run();
}

void RecordRows::insert(const DwellTiming& timing) {
  const auto usage = [&](std::uint64_t ThreadUsage::*count) {
    return timing.usage ? std::optional{*timing.usage.*count} : std::nullopt;
  };
  statements_->timing
      .bind(timing.dwell, start_.tick + timing.first_tick, timing.ticks, timing.skipped,
            timing.resettles, timing.max_lateness_ns, histogram_text(timing),
            usage(&ThreadUsage::minor_faults), usage(&ThreadUsage::major_faults),
            usage(&ThreadUsage::involuntary_switches))
      .run();
}

void RecordRows::insert(const Event& event) {
  if (event.kind == EventKind::remeasured) {
    // What follows stands in place of what was.
    Statement{database_, "DELETE FROM block WHERE dwell = ?"}.bind(event.dwell).run();
    attempts_.erase(event.dwell);
  }
  if (event.kind == EventKind::refined) insert_dwell(event.dwell, candidates_.at(event.candidate));
  Trip trip = event.trip;
  trip.tick += start_.tick;
  const std::string detail = event.trip.tripped() ? describe(trip, sensor_names_) : "";
  statements_->event
      .bind(start_.tick + event.tick, event.dwell, to_string(event.kind), event.channel,
            to_string(event.fault), event.value, detail)
      .run();
}

void RecordRows::insert(const Preflight& preflight) {
  statements_->event
      .bind(start_.tick + preflight.tick, preflight.dwell, to_string(EventKind::preflight),
            preflight.output, to_string(Fault::none), preflight.gain,
            describe(preflight, channel_names_))
      .run();
}

void RecordRows::insert(const Note& note) {
  statements_->event
      .bind(start_.tick + note.tick, note.dwell, to_string(note.kind), std::uint32_t{0},
            to_string(Fault::none), 0.0, std::string{note.text.data()})
      .run();
}

void RecordRows::insert(const TickSamples& samples) {
  for (std::uint32_t channel = 0; channel < samples.channels; ++channel) {
    statements_->sample.bind(start_.tick + samples.tick, channel, samples.values[channel]).run();
  }
}

void RecordRows::insert(const Lesson& lesson) {
  statements_->lesson
      .bind(lesson.dwell, attempt_of(lesson.dwell, lesson.attempt), lesson.tone, lesson.pair,
            lesson.response.real(), lesson.response.imag(), lesson.input_amplitude, lesson.white,
            lesson.scatter, lesson.scatter_dof, lesson.residual_rms)
      .run();
}

// What was begun before the interruption keeps its rows.
std::uint32_t RecordRows::attempt_of(std::uint32_t dwell, std::uint32_t attempt) const {
  const auto earlier = attempts_.find(dwell);
  return earlier == attempts_.end() ? attempt : earlier->second + attempt;
}

}  // namespace sinerig::record
