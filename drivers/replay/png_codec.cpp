#include "drivers/replay/png_codec.h"

#include <png.h>
#include <zlib.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <new>

#include "drivers/replay/image_file.h"

namespace grapnel {
namespace {

// Output is handed on in pieces of this size.
constexpr std::size_t kPieceBytes = 128u << 10;
// Text and colour profile chunks of a depth or colour image are small.
constexpr png_alloc_size_t kMaxChunkBytes = 8u << 20;

void copy_message(CodecMessage& message, const char* text) noexcept {
  std::snprintf(message.data(), message.size(), "%s", text);
}

[[noreturn]] void on_error(png_structp png, png_const_charp text) {
  copy_message(*static_cast<CodecMessage*>(png_get_error_ptr(png)), text);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

}  // namespace

struct PngDecoder::State {
  png_structp png = nullptr;
  png_infop info = nullptr;
  const std::byte* next = nullptr;
  std::size_t left = 0;
  CodecMessage message{};

  static void read(png_structp png, png_bytep out, png_size_t count) {
    auto* const state = static_cast<State*>(png_get_io_ptr(png));
    if (count > state->left) png_error(png, "the file is cut off");
    std::memcpy(out, state->next, count);
    state->next += count;
    state->left -= count;
  }
};

PngDecoder::PngDecoder(std::span<const std::byte> bytes) : state_(new State) {
  state_->next = bytes.data();
  state_->left = bytes.size();
  state_->png =
      png_create_read_struct(PNG_LIBPNG_VER_STRING, &state_->message, on_error, on_warning);
  if (state_->png != nullptr) state_->info = png_create_info_struct(state_->png);
}

PngDecoder::~PngDecoder() {
  png_destroy_read_struct(&state_->png, &state_->info, nullptr);
  delete state_;
}

const char* PngDecoder::message() const noexcept { return state_->message.data(); }

// Between setjmp and its longjmp no object with a destructor lives in these functions.
bool PngDecoder::read_info(PngInfo& info) noexcept {
  State& state = *state_;
  if (state.png == nullptr || state.info == nullptr) {
    copy_message(state.message, "out of memory");
    return false;
  }
  if (setjmp(png_jmpbuf(state.png)) != 0) return false;
  png_set_read_fn(state.png, &state, &State::read);
  png_set_user_limits(state.png, kMaxImageSide_px, kMaxImageSide_px);
  png_set_chunk_malloc_max(state.png, kMaxChunkBytes);
  png_read_info(state.png, state.info);
  info.width = static_cast<int>(png_get_image_width(state.png, state.info));
  info.height = static_cast<int>(png_get_image_height(state.png, state.info));
  info.bit_depth = png_get_bit_depth(state.png, state.info);
  info.gray = png_get_color_type(state.png, state.info) == PNG_COLOR_TYPE_GRAY;
  return true;
}

bool PngDecoder::read_rows(PngRows rows, std::span<std::byte> out) noexcept {
  State& state = *state_;
  if (setjmp(png_jmpbuf(state.png)) != 0) return false;
  if (rows == PngRows::Gray16) {
    png_set_swap(state.png);
  } else {
    png_set_expand(state.png);
    png_set_scale_16(state.png);
    png_set_strip_alpha(state.png);
    png_set_gray_to_rgb(state.png);
  }
  const int passes = png_set_interlace_handling(state.png);
  png_read_update_info(state.png, state.info);
  const png_uint_32 height = png_get_image_height(state.png, state.info);
  const png_size_t row_bytes = png_get_rowbytes(state.png, state.info);
  if (row_bytes * height != out.size()) png_error(state.png, "unexpected row size");
  for (int pass = 0; pass < passes; ++pass) {
    for (png_uint_32 v = 0; v < height; ++v) {
      png_read_row(state.png, reinterpret_cast<png_bytep>(out.data() + v * row_bytes), nullptr);
    }
  }
  png_read_end(state.png, nullptr);
  return true;
}

namespace {

/// Where an encoder's bytes go. Growing may throw, which libpng must not see.
struct PngSink {
  std::vector<std::byte>* out;

  static void write(png_structp png, png_bytep data, png_size_t count) {
    auto* const sink = static_cast<PngSink*>(png_get_io_ptr(png));
    bool grown = true;
    try {
      const auto* const first = reinterpret_cast<const std::byte*>(data);
      sink->out->insert(sink->out->end(), first, first + count);
    } catch (const std::bad_alloc&) {
      grown = false;
    }
    if (!grown) png_error(png, "out of memory");
  }
  static void flush(png_structp) {}
};

// One filter, not the best of five: speed is what is wanted.
void set_effort(png_structp png, PngEffort effort, PngRows rows) {
  const bool plain = effort == PngEffort::None;
  png_set_compression_level(png, plain ? 0 : 1);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, plain ? PNG_FILTER_NONE : PNG_FILTER_SUB);
  if (effort != PngEffort::Fast) return;
  // Depth has long runs of no reading; colour has few runs and pays for looking for them.
  png_set_compression_strategy(png, rows == PngRows::Gray16 ? Z_RLE : Z_HUFFMAN_ONLY);
}

bool encode_rows(png_structp png, png_infop info, PngSink& sink, PngRows rows, int width,
                 int height, const std::byte* first, std::size_t stride_bytes,
                 PngEffort effort) noexcept {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_write_fn(png, &sink, &PngSink::write, &PngSink::flush);
  set_effort(png, effort, rows);
  png_set_compression_buffer_size(png, kPieceBytes);
  const bool gray = rows == PngRows::Gray16;
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height),
               gray ? 16 : 8, gray ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (gray) png_set_swap(png);
  for (int v = 0; v < height; ++v) {
    const std::byte* const row = first + static_cast<std::size_t>(v) * stride_bytes;
    png_write_row(png, reinterpret_cast<png_const_bytep>(row));
  }
  png_write_end(png, info);
  return true;
}

}  // namespace

bool encode_png(PngRows rows, int width, int height, const std::byte* first,
                std::size_t stride_bytes, std::vector<std::byte>& out, CodecMessage& message,
                PngEffort effort) {
  copy_message(message, "out of memory");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &message, on_error, on_warning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  PngSink sink{&out};
  const bool encoded = info != nullptr && encode_rows(png, info, sink, rows, width, height, first,
                                                      stride_bytes, effort);
  png_destroy_write_struct(&png, &info);
  return encoded;
}

}  // namespace grapnel
