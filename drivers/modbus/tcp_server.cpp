#include "drivers/modbus/tcp_server.h"

#include <algorithm>
#include <cerrno>

#include <unistd.h>

#include "drivers/modbus/sockets.h"

namespace grapnel {
namespace {

constexpr int kAcceptsPerTurn = 16;
constexpr std::int64_t kAcceptPauseUs = 100'000;  // out of descriptors: no busy loop
constexpr std::int64_t kProbationUs = 1'000'000;
constexpr std::int64_t kLogPauseUs = 1'000'000;
constexpr std::int64_t kSecondUs = 1'000'000;

}  // namespace

TcpServer::TcpServer(const ModbusConfig& config, RequestHandler& handler, LogRing* log)
    : handler_(&handler), log_(log), config_(config) {}

TcpServer::~TcpServer() {
  for (Place& place : places_) place.connection.close();
  if (listener_ >= 0) close(listener_);
}

bool TcpServer::open(int inherited, std::string& problem) {
  if (!peers_.load(config_, problem)) {
    problem = "modbus: " + problem;
    return false;
  }
  if (inherited >= 0) {
    if (!adopt_listener(inherited, problem)) return false;
    listener_ = inherited;
  } else {
    listener_ = open_listener(config_, problem);
  }
  if (listener_ < 0) return false;
  places_ = std::vector<Place>(static_cast<std::size_t>(config_.max_connections));
  return true;
}

std::uint16_t TcpServer::port() const noexcept {
  return listener_ < 0 ? std::uint16_t{0} : local_port(listener_);
}

PeerId TcpServer::id_of(const Place& place) const noexcept {
  return static_cast<PeerId>(1 + (&place - places_.data()));
}

void TcpServer::fill_poll(std::span<pollfd> entries, std::int64_t now_us) const noexcept {
  entries[0] = {now_us >= accept_again_us_ ? listener_ : -1, POLLIN, 0};
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const TcpConnection& connection = places_[i].connection;
    entries[i + 1] = {connection.socket(), connection.poll_events(), 0};
  }
}

void TcpServer::serve(std::span<const pollfd> entries, std::int64_t now_us) noexcept {
  const std::size_t owner = handler_->command_block().owner();
  const std::size_t first = owner >= 1 && owner <= places_.size() ? owner - 1 : 0;
  for (std::size_t n = 0; n < places_.size(); ++n) {
    const std::size_t i = (first + n) % places_.size();
    Place& place = places_[i];
    if (!place.connection.is_open()) continue;
    if (!place.connection.serve(entries[i + 1].revents, *handler_, now_us)) drop(place);
  }
  settle_places(now_us);
  if (entries[0].revents != 0) accept_clients(now_us);
  handler_->counters().clients = static_cast<std::uint32_t>(
      std::count_if(places_.begin(), places_.end(),
                    [](const Place& place) { return place.connection.is_open(); }));
}

void TcpServer::accept_clients(std::int64_t now_us) noexcept {
  for (int i = 0; i < kAcceptsPerTurn; ++i) {
    std::uint32_t ipv4 = 0;
    const int client = accept_client(listener_, ipv4);
    if (client < 0) {
      const bool passing = errno == EAGAIN || errno == EINTR || errno == ECONNABORTED;
      if (!passing) accept_again_us_ = now_us + kAcceptPauseUs;
      return;
    }
    const PeerRole role = peers_.role(ipv4);
    if (role == PeerRole::Refused || place_for(role) == nullptr) {
      refuse(client, ipv4, now_us);
    } else {
      admit(client, role, now_us);
    }
  }
}

void TcpServer::refuse(int client, std::uint32_t ipv4, std::int64_t now_us) noexcept {
  close(client);
  ++handler_->counters().connections_refused;
  if (log_ == nullptr || now_us < log_again_us_) return;
  log_again_us_ = now_us + kLogPauseUs;
  log_->push(LogLevel::Warning, Stage::FieldBus, Code::NotAuthorised,
             "Modbus connection refused, IPv4 address {}; {} refused so far", ipv4,
             handler_->counters().connections_refused);
}

// Connections that do not own the command block.
std::size_t TcpServer::others() const noexcept {
  std::size_t count = 0;
  for (const Place& place : places_) {
    if (place.connection.is_open() && id_of(place) != handler_->command_block().owner()) ++count;
  }
  return count;
}

TcpServer::Place* TcpServer::free_place() noexcept {
  const auto found = std::find_if(places_.begin(), places_.end(),
                                  [](const Place& place) { return !place.connection.is_open(); });
  return found == places_.end() ? nullptr : &*found;
}

// The place that a newcomer of this role may take, which may hold a silent one on probation.
TcpServer::Place* TcpServer::place_for(PeerRole role) noexcept {
  if (others() + 1 < places_.size()) return free_place();
  if (role != PeerRole::Control || handler_->command_block().owner() != kNoPeer) return nullptr;
  Place* free = free_place();
  if (free != nullptr) return free;
  for (Place& place : places_) {
    if (place.on_probation && !place.connection.has_spoken()) return &place;
  }
  return nullptr;
}

void TcpServer::admit(int client, PeerRole role, std::int64_t now_us) noexcept {
  Place& place = *place_for(role);
  if (place.connection.is_open()) {
    drop(place);
    ++handler_->counters().connections_refused;
  }
  const bool kept_place = others() + 1 >= places_.size();
  const std::int64_t idle_limit_s =
      role == PeerRole::Control ? config_.control_idle_limit_s : config_.read_idle_limit_s;
  place.connection.open(client, Peer{id_of(place), role, false}, idle_limit_s * kSecondUs, now_us);
  place.on_probation = kept_place;
  place.probation_end_us = now_us + kProbationUs;
}

void TcpServer::drop(Place& place) noexcept {
  handler_->counters().bytes_discarded += static_cast<std::uint32_t>(place.connection.close());
  place.on_probation = false;
  handler_->command_block().release(id_of(place));
}

void TcpServer::settle_places(std::int64_t now_us) noexcept {
  const PeerId owner = handler_->command_block().owner();
  const std::size_t regular = places_.size() - 1;
  for (Place& place : places_) {
    if (!place.connection.is_open()) continue;
    if (place.on_probation) {
      if (id_of(place) == owner || others() <= regular) {
        place.on_probation = false;
      } else if (now_us >= place.probation_end_us) {
        drop(place);
        ++handler_->counters().connections_refused;
      }
    } else if (id_of(place) == last_owner_ && owner == kNoPeer && others() > regular) {
      // It lost the block by its heartbeat and stands in the kept place now.
      place.on_probation = true;
      place.probation_end_us = now_us + kProbationUs;
    }
  }
  last_owner_ = owner;
}

std::int64_t TcpServer::deadline_us() const noexcept {
  std::int64_t deadline_us = TcpConnection::kNever;
  for (const Place& place : places_) {
    if (!place.connection.is_open()) continue;
    if (place.connection.has_work()) return 0;
    deadline_us = std::min(deadline_us, place.connection.deadline_us());
    if (place.on_probation) deadline_us = std::min(deadline_us, place.probation_end_us);
  }
  return deadline_us;
}

}  // namespace grapnel
