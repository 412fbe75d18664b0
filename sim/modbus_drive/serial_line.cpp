#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <system_error>

#include "drivers/monotonic_time.h"
#include "sim/modbus_drive/line.h"

namespace sinerig::sim {
namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;

void require(bool condition, const std::string& what) {
  if (!condition) throw std::system_error(errno, std::generic_category(), what);
}

// CRC-16/MODBUS by long division: bits enter at the low end of a reflected register.
std::uint16_t check_sum(const Bytes& bytes) {
  unsigned remainder = 0xFFFF;
  for (const unsigned byte : bytes) {
    remainder ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      const bool divides = remainder % 2 == 1;
      remainder /= 2;
      if (divides) remainder ^= 0xA001;
    }
  }
  return static_cast<std::uint16_t>(remainder);
}

class SerialLine final : public Line {
 public:
  explicit SerialLine(const DriveSettings& settings) : settings_{settings} { open_pair(); }
  ~SerialLine() override {
    close_pair();
    unlink(settings_.link.c_str());
  }

  std::string address() const override { return settings_.link; }

  std::vector<pollfd> inputs() const override {
    return {{.fd = master_, .events = POLLIN, .revents = 0}};
  }

  std::vector<Frame> receive() override {
    std::uint8_t buffer[512];
    while (true) {
      const ssize_t count = read(master_, buffer, sizeof buffer);
      if (count <= 0) break;
      input_.insert(input_.end(), buffer, buffer + count);
    }
    std::vector<Frame> frames;
    while (const std::size_t length = request_length()) {
      if (input_.size() < length) break;
      take_frame(length, frames);
    }
    return frames;
  }

  void send(const Frame& reply, bool spoiled) override {
    Bytes bytes{reply.unit};
    bytes.insert(bytes.end(), reply.pdu.begin(), reply.pdu.end());
    const unsigned sum = check_sum(bytes) ^ (spoiled ? 0x0100U : 0U);
    bytes.push_back(static_cast<std::uint8_t>(sum % 256));
    bytes.push_back(static_cast<std::uint8_t>(sum / 256));
    put(bytes);
  }

  // The adapter is unplugged, and another one comes up under the same name.
  void drop() override {
    close_pair();
    open_pair();
  }

  void set_open(bool /*open*/) override { input_.clear(); }

  std::int64_t wire_ns(const Frame& frame) const override {
    const auto bytes = static_cast<std::int64_t>(1 + frame.pdu.size() + 2);
    return bytes * settings_.bits_per_byte * ns_per_s / settings_.baud;
  }

 private:
  // Of the request at the head of the input, check sum included; 0: not known yet.
  std::size_t request_length() {
    if (input_.size() < 2) return 0;
    switch (input_[1]) {
      case 3:
      case 4:
      case 6: return 8;
      case 16: return input_.size() < 7 ? 0 : std::size_t{9} + input_[6];
      case 23: return input_.size() < 11 ? 0 : std::size_t{13} + input_[10];
      default: input_.clear(); return 0;
    }
  }

  void take_frame(std::size_t length, std::vector<Frame>& frames) {
    const auto body_end = input_.begin() + static_cast<std::ptrdiff_t>(length - 2);
    const Bytes body(input_.begin(), body_end);
    const unsigned sum = input_[length - 2] + 256U * input_[length - 1];
    if (sum != check_sum(body)) {
      input_.clear();  // whatever follows begins with the next silence
      return;
    }
    if (monotonic_now_ns() - last_put_ns_ < settings_.silence_ns) {
      input_.clear();  // the end of a frame that began with the reply
      return;
    }
    if (settings_.echo) put(Bytes(input_.begin(), body_end + 2));
    frames.push_back(
        {.from = 0, .number = 0, .unit = body[0], .pdu = Bytes(body.begin() + 1, body.end())});
    input_.erase(input_.begin(), body_end + 2);
  }

  void put(const Bytes& bytes) {
    last_put_ns_ = monotonic_now_ns();
    [[maybe_unused]] const ssize_t written = write(master_, bytes.data(), bytes.size());
  }

  void open_pair() {
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    require(master_ >= 0 && grantpt(master_) == 0 && unlockpt(master_) == 0, "pseudo-terminal");
    char name[128];
    require(ptsname_r(master_, name, sizeof name) == 0, "pseudo-terminal");
    // Kept open: without a holder the line would be gone whenever the other side closes it.
    slave_ = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    require(slave_ >= 0, name);
    termios raw{};
    require(tcgetattr(slave_, &raw) == 0, name);
    cfmakeraw(&raw);
    require(tcsetattr(slave_, TCSANOW, &raw) == 0, name);
    unlink(settings_.link.c_str());
    require(symlink(name, settings_.link.c_str()) == 0, settings_.link);
  }

  void close_pair() {
    close(slave_);
    close(master_);
    input_.clear();
  }

  const DriveSettings& settings_;
  int master_ = -1;
  int slave_ = -1;
  Bytes input_;
  std::int64_t last_put_ns_ = 0;
};

}  // namespace

std::unique_ptr<Line> make_serial_line(const DriveSettings& settings) {
  return std::make_unique<SerialLine>(settings);
}

}  // namespace sinerig::sim
