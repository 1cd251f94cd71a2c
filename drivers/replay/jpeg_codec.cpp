#include "drivers/replay/jpeg_codec.h"

#include <csetjmp>
#include <cstdio>
// jpeglib.h needs FILE and size_t declared before it.
#include <jpeglib.h>

#include <cstddef>

namespace grapnel {

struct JpegDecoder::State {
  jpeg_decompress_struct decoder{};
  jpeg_error_mgr errors{};
  std::jmp_buf on_error{};
  CodecMessage message{};
  std::span<const std::byte> bytes;

  static State& of(j_common_ptr decoder) noexcept {
    return *static_cast<State*>(decoder->client_data);
  }
  [[noreturn]] static void fail(j_common_ptr decoder) {
    State& state = of(decoder);
    char text[JMSG_LENGTH_MAX];
    state.errors.format_message(decoder, text);
    std::snprintf(state.message.data(), state.message.size(), "%.*s",
                  static_cast<int>(state.message.size() - 1), text);
    std::longjmp(state.on_error, 1);
  }
  // Level -1 is a warning: damaged or missing data that libjpeg would paper over.
  static void on_message(j_common_ptr decoder, int level) {
    if (level < 0) fail(decoder);
  }
};

JpegDecoder::JpegDecoder(std::span<const std::byte> bytes) : state_(new State) {
  State& state = *state_;
  state.bytes = bytes;
  state.decoder.err = jpeg_std_error(&state.errors);
  state.errors.error_exit = &State::fail;
  state.errors.emit_message = &State::on_message;
  state.decoder.client_data = &state;
  if (setjmp(state.on_error) == 0) jpeg_create_decompress(&state.decoder);
  // jpeg_create_decompress clears the struct but for err and client_data.
}

JpegDecoder::~JpegDecoder() {
  jpeg_destroy_decompress(&state_->decoder);
  delete state_;
}

const char* JpegDecoder::message() const noexcept { return state_->message.data(); }

// Between setjmp and its longjmp no object with a destructor lives in these functions.
bool JpegDecoder::read_size(int& width, int& height) noexcept {
  State& state = *state_;
  if (setjmp(state.on_error) != 0) return false;
  jpeg_mem_src(&state.decoder, reinterpret_cast<const unsigned char*>(state.bytes.data()),
               state.bytes.size());
  jpeg_read_header(&state.decoder, TRUE);
  width = static_cast<int>(state.decoder.image_width);
  height = static_cast<int>(state.decoder.image_height);
  return true;
}

bool JpegDecoder::read_rows(std::span<std::byte> out) noexcept {
  State& state = *state_;
  if (setjmp(state.on_error) != 0) return false;
  state.decoder.out_color_space = JCS_RGB;
  jpeg_start_decompress(&state.decoder);
  const std::size_t row_bytes = std::size_t{state.decoder.output_width} * 3;
  while (state.decoder.output_scanline < state.decoder.output_height) {
    auto* row = reinterpret_cast<JSAMPROW>(out.data() + state.decoder.output_scanline * row_bytes);
    jpeg_read_scanlines(&state.decoder, &row, 1);
  }
  jpeg_finish_decompress(&state.decoder);
  return true;
}

}  // namespace grapnel
