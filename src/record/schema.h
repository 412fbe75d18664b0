// The sweep file, version 1: tables and columns may be added to it, none changes its meaning.
// SQLite keeps the comments, so `sqlite3 NAME.sweep .schema` documents any file by itself.
#pragma once

#include <cstdint>

namespace sinerig::record {

inline constexpr std::int64_t application_id = 0x53524947;  // "SRIG"
inline constexpr std::int64_t schema_version = 1;

inline constexpr const char* schema_sql = R"sql(
CREATE TABLE run (        -- facts about the whole run, one per row
  key   TEXT PRIMARY KEY, -- rig_name, rig_text, rate_hz, clock, started_utc, finished_utc, host, …
  value ANY
) WITHOUT ROWID;

CREATE TABLE channel (
  id   INTEGER PRIMARY KEY, -- 0 command, 1 applied, 2… sensors in the order of the rig file
  name TEXT NOT NULL,
  unit TEXT NOT NULL
);

CREATE TABLE dwell (             -- the plan
  id             INTEGER PRIMARY KEY, -- running order from 0
  asked_hz       REAL NOT NULL,
  block_samples  INTEGER NOT NULL,
  ramp_samples   INTEGER NOT NULL,
  settle_samples INTEGER NOT NULL,    -- waited for before measuring, ramp included
  blocks         INTEGER NOT NULL,    -- measured at least
  max_samples    INTEGER NOT NULL,    -- of the whole dwell at most, settling included
  sub_band       INTEGER NOT NULL DEFAULT 0 -- which of the sweep's sub-bands, from 0
);

CREATE TABLE tone (
  dwell     INTEGER NOT NULL REFERENCES dwell,
  tone      INTEGER NOT NULL,
  cycles    INTEGER NOT NULL,   -- per block: frequency = rate_hz · cycles / block_samples
  amplitude REAL NOT NULL,      -- of the command, in its unit
  phase_rad REAL NOT NULL,
  PRIMARY KEY (dwell, tone)
) WITHOUT ROWID;

CREATE TABLE point (            -- H = Y/U at one frequency, written when its dwell has finished
  dwell            INTEGER NOT NULL REFERENCES dwell,
  tone             INTEGER NOT NULL,
  response         INTEGER NOT NULL, -- 0 is the one that the dwells are judged by
  input            INTEGER NOT NULL REFERENCES channel,
  output           INTEGER NOT NULL REFERENCES channel,
  freq_hz          REAL NOT NULL,
  re               REAL,        -- of H, unit of output per unit of input; NULL: no block completed
  im               REAL,
  var_re           REAL,        -- covariance of (re, im); NULL: not known
  cov_re_im        REAL,
  var_im           REAL,
  dof              REAL,        -- degrees of freedom behind the covariance
  gain_interval_db   REAL,      -- half widths of the 95 % intervals, what the transient may have
  phase_interval_deg REAL,      -- left included
  input_amplitude  REAL,
  output_amplitude REAL,
  snr_db           REAL,        -- power of the tone over that of the residual, per sample
  distortion       REAL,        -- harmonics beyond the noise, relative to the tone
  drift_per_s      REAL,        -- of the output
  samples          REAL NOT NULL, -- that the estimate was made from
  lost             REAL NOT NULL, -- that were missing among them
  seconds          REAL NOT NULL, -- bench time of the dwell
  status           TEXT NOT NULL, -- good unsettled low_signal clipped distorted rt_fault stopped
  reason           TEXT NOT NULL,
  reason_value     REAL,
  settled_by       TEXT NOT NULL DEFAULT 'detection', -- how its transient was dealt with: wait,
                                -- detection, model, fallback (its model was abandoned), both (a
                                -- modelled dwell that was checked by detection)
  PRIMARY KEY (dwell, tone, response)
) WITHOUT ROWID;

CREATE TABLE block (            -- plain sums of a complete block: y ~ mean + a cos(ωt) + b sin(ωt),
                                -- t = 0 at the start of the dwell
  dwell      INTEGER NOT NULL,
  attempt    INTEGER NOT NULL,  -- more than one where the level was corrected or the run
                                -- interrupted; the last one counts
  block      INTEGER NOT NULL,
  tone       INTEGER NOT NULL,
  channel    INTEGER NOT NULL,
  first_tick INTEGER NOT NULL,
  a          REAL,
  b          REAL,
  mean       REAL,
  PRIMARY KEY (dwell, attempt, block, tone, channel)
) WITHOUT ROWID;

CREATE TABLE part (             -- a run is one part, and one more for each time it was resumed
  id           INTEGER PRIMARY KEY, -- from 0
  started_utc  TEXT NOT NULL,
  finished_utc TEXT,            -- NULL while it runs, and for ever where it was killed
  outcome      TEXT,            -- done, interrupted, stopped; killed: said by the part that follows
  detail       TEXT NOT NULL DEFAULT '', -- for people
  first_dwell  INTEGER NOT NULL, -- where it began; a dwell belongs to the last part that began at or
                                -- before it
  first_tick   INTEGER NOT NULL -- ticks count on from part to part
);

CREATE TABLE lesson (           -- what a try at a dwell taught those that follow: a resumed run begins
                                -- with it. Variances are of one component of H
  dwell           INTEGER NOT NULL,
  attempt         INTEGER NOT NULL,
  tone            INTEGER NOT NULL,
  response        INTEGER NOT NULL,
  re              REAL,
  im              REAL,
  input_amplitude REAL,
  white           REAL,         -- variance, were the residual white
  scatter         REAL,         -- variance from the scatter of clusters
  scatter_dof     REAL,
  residual_rms    REAL,         -- of the output
  PRIMARY KEY (dwell, attempt, tone, response)
) WITHOUT ROWID;

CREATE TABLE durability (       -- real time only: how far behind the loop the disk is
  dwell INTEGER PRIMARY KEY,
  lag_s REAL NOT NULL           -- from the end of the dwell until its points were on the disk
);

CREATE TABLE timing (           -- of the loop, per dwell
  dwell           INTEGER PRIMARY KEY,
  first_tick      INTEGER NOT NULL,
  ticks           INTEGER NOT NULL, -- executed
  skipped         INTEGER NOT NULL, -- lost to overruns
  resettles       INTEGER NOT NULL,
  max_lateness_ns INTEGER NOT NULL,
  lateness_us     TEXT NOT NULL,    -- counts: below 1 µs, [1, 2), [2, 4), [4, 8) µs …
  minor_faults    INTEGER,          -- page faults of the loop's thread; NULL: virtual time
  major_faults    INTEGER,          -- those that had to wait for a disk
  involuntary_switches INTEGER      -- times that another thread was given its CPU
);

CREATE TABLE event (
  id      INTEGER PRIMARY KEY,
  tick    INTEGER NOT NULL,
  dwell   INTEGER NOT NULL,
  kind    TEXT NOT NULL,
  channel INTEGER,              -- NULL where it concerns none
  fault   TEXT NOT NULL,
  value   REAL,
  detail  TEXT NOT NULL         -- for people
);

CREATE TABLE sample (           -- only with [output] samples = true
  tick    INTEGER NOT NULL,
  channel INTEGER NOT NULL,
  value   REAL,
  PRIMARY KEY (tick, channel)
) WITHOUT ROWID;
)sql";

}  // namespace sinerig::record
