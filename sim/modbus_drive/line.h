// How a simulated drive is reached: frames in, frames out. A TCP port, or a serial line made of a
// pseudo-terminal.
#pragma once

#include <cstdint>
#include <memory>
#include <poll.h>
#include <string>
#include <vector>

#include "sim/modbus_drive/drive.h"
#include "sim/modbus_drive/settings.h"

namespace sinerig::sim {

struct Frame {
  std::uint64_t from = 0;    // which connection
  std::uint16_t number = 0;  // transaction identifier, TCP
  std::uint8_t unit = 0;
  Bytes pdu;
};

class Line {
 public:
  virtual ~Line() = default;

  virtual std::string address() const = 0;

  // What to wait on.
  virtual std::vector<pollfd> inputs() const = 0;

  // Every complete request that has arrived.
  virtual std::vector<Frame> receive() = 0;

  // `spoiled`: with a wrong check sum, or, where there is none, as nonsense.
  virtual void send(const Frame& reply, bool spoiled) = 0;

  // Ends all connections; new ones can be made at once.
  virtual void drop() = 0;

  // Whether anybody can connect: not while the drive boots.
  virtual void set_open(bool open) = 0;

  virtual std::int64_t wire_ns(const Frame& frame) const = 0;
};

// Throw std::system_error.
std::unique_ptr<Line> make_tcp_line(const DriveSettings& settings);
std::unique_ptr<Line> make_serial_line(const DriveSettings& settings);

}  // namespace sinerig::sim
