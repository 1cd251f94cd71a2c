#include "drivers/replay/jpeg_codec.h"

#include <csetjmp>
#include <cstdio>
// jpeglib.h needs FILE and size_t declared before it.
#include <jpeglib.h>

#include <cstddef>
#include <cstdlib>

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

namespace {

/// One encoding; libjpeg allocates `data`.
struct JpegEncoder {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  std::jmp_buf on_error{};
  unsigned char* data = nullptr;
  unsigned long bytes = 0;
  CodecMessage* message = nullptr;

  [[noreturn]] static void fail(j_common_ptr encoder) {
    auto& self = *static_cast<JpegEncoder*>(encoder->client_data);
    char text[JMSG_LENGTH_MAX];
    self.errors.format_message(encoder, text);
    std::snprintf(self.message->data(), self.message->size(), "%.*s",
                  static_cast<int>(self.message->size() - 1), text);
    std::longjmp(self.on_error, 1);
  }
  static void ignore(j_common_ptr, int) {}
};

// Between setjmp and its longjmp no object with a destructor lives here.
bool encode_rows(JpegEncoder& job, int width, int height, const std::byte* first,
                 std::size_t stride_bytes, int quality) noexcept {
  if (setjmp(job.on_error) != 0) return false;
  jpeg_create_compress(&job.encoder);
  jpeg_mem_dest(&job.encoder, &job.data, &job.bytes);
  job.encoder.image_width = static_cast<JDIMENSION>(width);
  job.encoder.image_height = static_cast<JDIMENSION>(height);
  job.encoder.input_components = 3;
  job.encoder.in_color_space = JCS_RGB;
  jpeg_set_defaults(&job.encoder);
  jpeg_set_quality(&job.encoder, quality, TRUE);
  for (int i = 0; i < job.encoder.num_components; ++i) {
    job.encoder.comp_info[i].h_samp_factor = 1;
    job.encoder.comp_info[i].v_samp_factor = 1;
  }
  jpeg_start_compress(&job.encoder, TRUE);
  while (job.encoder.next_scanline < job.encoder.image_height) {
    const std::byte* const row = first + job.encoder.next_scanline * stride_bytes;
    auto* writable = reinterpret_cast<JSAMPROW>(const_cast<std::byte*>(row));
    jpeg_write_scanlines(&job.encoder, &writable, 1);
  }
  jpeg_finish_compress(&job.encoder);
  return true;
}

}  // namespace

bool encode_jpeg(int width, int height, const std::byte* first, std::size_t stride_bytes,
                 int quality, std::vector<std::byte>& out, CodecMessage& message) {
  JpegEncoder job;
  job.message = &message;
  job.encoder.err = jpeg_std_error(&job.errors);
  job.errors.error_exit = &JpegEncoder::fail;
  job.errors.emit_message = &JpegEncoder::ignore;
  job.encoder.client_data = &job;
  const bool encoded = encode_rows(job, width, height, first, stride_bytes, quality);
  if (encoded) {
    const auto* const data = reinterpret_cast<const std::byte*>(job.data);
    out.assign(data, data + job.bytes);
  }
  jpeg_destroy_compress(&job.encoder);
  std::free(job.data);
  return encoded;
}

}  // namespace grapnel
