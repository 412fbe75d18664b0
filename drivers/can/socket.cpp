#include "drivers/can/socket.h"

#include <cerrno>
#include <cstring>
#include <ctime>
#include <net/if.h>
#include <poll.h>
#include <unistd.h>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <system_error>

namespace sinerig::can {
namespace {

constexpr int classic_mtu = CAN_MTU;
constexpr int fd_mtu = CANFD_MTU;

[[noreturn]] void refuse(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

template <class Value>
void set_option(int fd, int level, int option, const Value& value, const char* what) {
  if (setsockopt(fd, level, option, &value, sizeof value) != 0) refuse(what);
}

ifreq request_for(const std::string& interface) noexcept {
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  return request;
}

std::int64_t nanoseconds(const timespec& time) noexcept {
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

// In bus-off the kernel takes frames, says that they are sent, and drops them: only the carrier
// tells. A controller that restarts by itself is given the time for it.
bool has_carrier(int fd, const std::string& interface) noexcept {
  constexpr int tries = 30;
  constexpr timespec between{0, 10'000'000};
  for (int n = 0; n < tries; ++n) {
    ifreq request = request_for(interface);
    if (ioctl(fd, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_RUNNING) != 0)
      return true;
    nanosleep(&between, nullptr);
  }
  return false;
}

bool bind_to(int fd, const std::string& interface) noexcept {
  ifreq request = request_for(interface);
  if (ioctl(fd, SIOCGIFINDEX, &request) != 0) return false;
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = request.ifr_ifindex;
  return bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

SendResult result_of(int error) noexcept {
  switch (error) {
    case ENOBUFS:
    case EAGAIN: return SendResult::queue_full;
    case ENETDOWN: return SendResult::link_down;
    case ENODEV:
    case ENXIO: return SendResult::gone;
    default: return SendResult::failed;
  }
}

}  // namespace

Socket::Socket(const std::string& interface, bool fd_frames)
    : interface_(interface), arrival_times_(read_clocks()) {
  if (interface.empty() || interface.size() >= IFNAMSIZ) {
    errno = EINVAL;
    refuse("CAN interface '" + interface + "': a name has 1 to 15 characters");
  }
  fd_ = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd_ < 0)
    refuse(
        "CAN interface " + interface +
        ": this kernel has no CAN sockets (`modprobe can-raw`; Debian's cloud kernels lack it; " +
        "tools/virtual-bench has one)");
  try {
    ifreq request = request_for(interface);
    if (ioctl(fd_, SIOCGIFFLAGS, &request) != 0)
      refuse("CAN interface " + interface + " is not there; `ip -brief link` lists what is");
    const bool up = (request.ifr_flags & IFF_UP) != 0;
    if (!up) {
      errno = ENETDOWN;
      refuse("CAN interface " + interface + " is down; `ip link set " + interface +
             " up type can bitrate 1000000 restart-ms 100` brings it up");
    }
    if (ioctl(fd_, SIOCGIFMTU, &request) != 0 ||
        (request.ifr_mtu != classic_mtu && request.ifr_mtu != fd_mtu)) {
      errno = EPROTOTYPE;
      refuse("interface " + interface + " is no CAN interface");
    }
    if (!has_carrier(fd_, interface)) {
      errno = ENETDOWN;
      refuse("CAN interface " + interface +
             " is up but has no carrier: its controller is bus-off? `ip -details link show " +
             interface + "` tells; `ip link set " + interface + " down`, then `ip link set " +
             interface + " up type can restart-ms 100` starts it again, and after every bus-off");
    }
    if (fd_frames && request.ifr_mtu != fd_mtu) {
      errno = EMSGSIZE;
      refuse("CAN interface " + interface + " carries classic frames only, the rig sends CAN-FD; " +
             "bring it up with `dbitrate … fd on`");
    }
    if (fd_frames)
      set_option(fd_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, int{1}, "CAN-FD frames cannot be enabled");
    set_option(fd_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, can_err_mask_t{CAN_ERR_MASK},
               "CAN error frames cannot be enabled");
    set_option(fd_, SOL_SOCKET, SO_RXQ_OVFL, int{1}, "lost frames cannot be counted");
    const int stamps = SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_RX_SOFTWARE |
                       SOF_TIMESTAMPING_RAW_HARDWARE | SOF_TIMESTAMPING_RX_HARDWARE;
    set_option(fd_, SOL_SOCKET, SO_TIMESTAMPING, stamps, "receive time stamps cannot be enabled");
    if (!bind_to(fd_, interface)) refuse("CAN interface " + interface + " cannot be bound to");
  } catch (...) {
    close(fd_);
    throw;
  }
}

Socket::~Socket() {
  close(fd_);
}

void Socket::set_filters(const std::vector<IdFilter>& filters) {
  filters_.clear();
  for (const IdFilter& filter : filters)
    filters_.push_back({filter.id | (filter.extended ? CAN_EFF_FLAG : 0U),
                        filter.mask | CAN_EFF_FLAG | CAN_RTR_FLAG});
  if (!apply_filters())
    refuse("CAN interface " + interface_ + ": the kernel refused " +
           std::to_string(filters.size()) + " receive filters");
}

bool Socket::apply_filters() const noexcept {
  const auto bytes = static_cast<socklen_t>(filters_.size() * sizeof(can_filter));
  return setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FILTER, filters_.data(), bytes) == 0;
}

SendResult Socket::send(const Frame& frame) noexcept {
  canfd_frame raw{};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U);
  raw.len = frame.length;
  raw.flags = frame.bit_rate_switch ? CANFD_BRS : 0;
  std::memcpy(raw.data, frame.data.data(), frame.length);
  const std::size_t size = frame.fd ? CANFD_MTU : CAN_MTU;
  const SystemCall never_waits;
  const ssize_t sent = ::send(fd_, &raw, size, MSG_DONTWAIT);
  if (sent == static_cast<ssize_t>(size)) return SendResult::sent;
  const SendResult result = result_of(errno);
  if (result == SendResult::link_down || result == SendResult::gone) arrival_times_.restart();
  return result;
}

ReceiveResult Socket::receive(Received& received) noexcept {
  canfd_frame raw{};
  iovec vector{&raw, sizeof raw};
  alignas(cmsghdr) char
      control[CMSG_SPACE(sizeof(scm_timestamping)) + CMSG_SPACE(sizeof(std::uint32_t)) + 64];
  msghdr message{};
  message.msg_iov = &vector;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;

  const auto receive_at_once = [&] {
    const SystemCall never_waits;
    return recvmsg(fd_, &message, MSG_DONTWAIT);
  };
  const ssize_t size = receive_at_once();
  if (size < 0) {
    const bool down = errno == ENETDOWN;
    if (!down && errno != ENODEV && errno != ENXIO) {
      arrival_times_.queue_is_empty();
      return ReceiveResult::nothing;
    }
    arrival_times_.restart();
    return down ? ReceiveResult::link_down : ReceiveResult::gone;
  }
  if (size != classic_mtu && size != fd_mtu) return ReceiveResult::nothing;

  Stamps given;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr;
       part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET) continue;
    if (part->cmsg_type == SO_TIMESTAMPING) {
      scm_timestamping stamps{};
      std::memcpy(&stamps, CMSG_DATA(part), sizeof stamps);
      given = {.kernel_ns = nanoseconds(stamps.ts[0]), .adapter_ns = nanoseconds(stamps.ts[2])};
    } else if (part->cmsg_type == SO_RXQ_OVFL) {
      std::memcpy(&overflows_, CMSG_DATA(part), sizeof overflows_);
    }
  }
  received.time_ns = arrival_times_.of(given, read_clocks());
  if (given.adapter_ns != 0) adapter_stamps_ = true;

  if ((raw.can_id & CAN_ERR_FLAG) != 0) {
    received.error_class = raw.can_id & CAN_ERR_MASK;
    return ReceiveResult::error_frame;
  }
  Frame& frame = received.frame;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.id = raw.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.remote = (raw.can_id & CAN_RTR_FLAG) != 0;
  frame.fd = size == fd_mtu;
  frame.bit_rate_switch = frame.fd && (raw.flags & CANFD_BRS) != 0;
  const std::size_t longest = frame.fd ? max_fd_bytes : max_classic_bytes;
  frame.length = raw.len <= longest ? raw.len : static_cast<std::uint8_t>(longest);
  std::memcpy(frame.data.data(), raw.data, sizeof raw.data);
  return ReceiveResult::frame;
}

bool Socket::rebind() noexcept {
  arrival_times_.restart();
  const SystemCall never_waits;
  return bind_to(fd_, interface_) && apply_filters();
}

// The kernel charges a frame, FD or not, with up to 960 bytes, and doubles what is
// asked for.
void Socket::set_send_room(std::size_t frames) noexcept {
  const int bytes = static_cast<int>(frames * 1024 / 2);
  setsockopt(fd_, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
}

void Socket::wait(std::int64_t timeout_ns) const noexcept {
  pollfd waiting{fd_, POLLIN, 0};
  const timespec timeout{timeout_ns / 1'000'000'000, timeout_ns % 1'000'000'000};
  ppoll(&waiting, 1, &timeout, nullptr);
}

}  // namespace sinerig::can
