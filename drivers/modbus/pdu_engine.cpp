#include "drivers/modbus/pdu_engine.h"

#include <cerrno>

#include <sys/socket.h>
#include <unistd.h>

namespace grapnel {

PduEngine::PduEngine(RegisterImage& image) noexcept {
  // Both tables start at 0, the range is checked before the call.
  mapping_.nb_registers = static_cast<int>(RegisterImage::kSize);
  mapping_.nb_input_registers = static_cast<int>(RegisterImage::kSize);
  mapping_.tab_registers = image.data();
  mapping_.tab_input_registers = image.data();
}

PduEngine::~PduEngine() {
  if (library_end_ >= 0) close(library_end_);
  if (our_end_ >= 0) close(our_end_);
}

Status PduEngine::open() {
  int ends[2] = {-1, -1};
  // Sequenced packets keep one answer one read.
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) != 0) {
    return Error{Code::InternalFault, Stage::FieldBus, errno};
  }
  library_end_ = ends[0];
  our_end_ = ends[1];
  context_.reset(modbus_new_tcp("127.0.0.1", 0));
  if (context_ == nullptr) return Error{Code::InternalFault, Stage::FieldBus, errno};
  modbus_set_socket(context_.get(), library_end_);
  // The library sleeps this long before some exceptions; ours are made before it is asked.
  modbus_set_response_timeout(context_.get(), 0, 1);
  return {};
}

std::size_t PduEngine::answer(std::span<const std::uint8_t> adu,
                              std::span<std::uint8_t> out) noexcept {
  const int sent =
      modbus_reply(context_.get(), adu.data(), static_cast<int>(adu.size()), &mapping_);
  if (sent <= 0) return 0;
  const ssize_t length = recv(our_end_, out.data(), out.size(), MSG_DONTWAIT);
  return length == sent ? static_cast<std::size_t>(length) : 0;
}

}  // namespace grapnel
