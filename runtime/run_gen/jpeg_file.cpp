// libjpeg reports errors by longjmp, because exceptions cannot pass through C. Between setjmp and the jump no object
// with a destructor is created, and nothing that is used afterwards is changed.
#include "run_gen/jpeg_file.h"

#include <csetjmp>
#include <cstdio>
#include <memory>
#include <vector>

#include <jpeglib.h>

#include <jerror.h>

namespace retrograde::run_gen {

namespace {

constexpr int quality = 98;  // high enough for comparing pictures

// Warnings after which the decoder invents samples, as for a truncated file.
bool is_damage(int warning) {
  return warning == JWRN_JPEG_EOF || warning == JWRN_HIT_MARKER || warning == JWRN_HUFF_BAD_CODE ||
         warning == JWRN_ARITH_BAD_CODE || warning == JWRN_MUST_RESYNC;
}

struct Errors {
  jpeg_error_mgr manager;
  std::jmp_buf back;
  char message[JMSG_LENGTH_MAX] = "";  // the first message

  void note(j_common_ptr codec) {
    if (!*message) codec->err->format_message(codec, message);
  }
};

Errors& errors_of(j_common_ptr codec) { return *static_cast<Errors*>(codec->client_data); }

template <typename Codec>
void report_to(Errors& errors, Codec& codec) {
  codec.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = [](j_common_ptr from) {
    errors_of(from).note(from);
    std::longjmp(errors_of(from).back, 1);
  };
  errors.manager.emit_message = [](j_common_ptr from, int level) {
    if (level < 0 && is_damage(from->err->msg_code)) errors_of(from).note(from);
  };
  codec.client_data = &errors;
}

struct Decoder {
  jpeg_decompress_struct codec = {};
  Errors errors;
  ~Decoder() { jpeg_destroy_decompress(&codec); }
};
struct Encoder {
  jpeg_compress_struct codec = {};
  Errors errors;
  ~Encoder() { jpeg_destroy_compress(&codec); }
};

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

File open(const std::string& path, const char* mode) {
  File file(std::fopen(path.c_str(), mode), std::fclose);
  if (!file)
    throw Problem("the file \"" + path + "\" cannot be " + (*mode == 'r' ? "read" : "written"));
  return file;
}

// On false, errors.message says why. client_data survives jpeg_create_*, which clears the other fields.
bool start(Decoder& decoder, std::FILE* file) {
  report_to(decoder.errors, decoder.codec);
  if (setjmp(decoder.errors.back)) return false;
  jpeg_create_decompress(&decoder.codec);
  jpeg_stdio_src(&decoder.codec, file);
  jpeg_read_header(&decoder.codec, TRUE);
  const bool is_grey = decoder.codec.jpeg_color_space == JCS_GRAYSCALE;
  decoder.codec.out_color_space = is_grey ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_start_decompress(&decoder.codec);
  return true;
}

// Also returns false if the decoder invented samples.
bool read_lines(Decoder& decoder, uint8_t* samples, size_t bytes_of_line) {
  if (setjmp(decoder.errors.back)) return false;
  while (decoder.codec.output_scanline < decoder.codec.output_height) {
    JSAMPROW line = samples + decoder.codec.output_scanline * bytes_of_line;
    jpeg_read_scanlines(&decoder.codec, &line, 1);
  }
  jpeg_finish_decompress(&decoder.codec);
  return !*decoder.errors.message;
}

bool write_lines(Encoder& encoder, std::FILE* file, int width, int height, int channels,
                 const uint8_t* samples) {
  jpeg_compress_struct& codec = encoder.codec;
  report_to(encoder.errors, codec);
  if (setjmp(encoder.errors.back)) return false;
  jpeg_create_compress(&codec);
  jpeg_stdio_dest(&codec, file);
  codec.image_width = static_cast<JDIMENSION>(width);
  codec.image_height = static_cast<JDIMENSION>(height);
  codec.input_components = channels;
  codec.in_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&codec);
  jpeg_set_quality(&codec, quality, TRUE);
  jpeg_start_compress(&codec, TRUE);
  while (codec.next_scanline < codec.image_height) {
    const size_t first = static_cast<size_t>(codec.next_scanline) * codec.image_width;
    JSAMPROW line = const_cast<uint8_t*>(samples) + first * static_cast<size_t>(channels);
    jpeg_write_scanlines(&codec, &line, 1);
  }
  jpeg_finish_compress(&codec);
  return true;
}

}  // namespace

Image read_jpeg(const std::string& path) {
  const File file = open(path, "rb");
  Decoder decoder;
  const auto check = [&](bool is_done) {
    if (!is_done)
      throw Problem("the file \"" + path + "\" cannot be read: " + decoder.errors.message);
  };
  check(start(decoder, file.get()));
  const int channels = decoder.codec.output_components;
  auto image = Halide::Runtime::Buffer<uint8_t>::make_interleaved(
      static_cast<int>(decoder.codec.output_width), static_cast<int>(decoder.codec.output_height),
      channels);
  const size_t line = static_cast<size_t>(channels) * decoder.codec.output_width;
  check(read_lines(decoder, image.data(), line));
  return image;
}

void write_jpeg(const std::string& path, int width, int height, int channels,
                const std::string& samples) {
  File file = open(path, "wb");
  Encoder encoder;
  const auto* bytes = reinterpret_cast<const uint8_t*>(samples.data());
  if (!write_lines(encoder, file.get(), width, height, channels, bytes))
    throw Problem("the file \"" + path + "\" cannot be written: " + encoder.errors.message);
  if (std::fclose(file.release()) != 0)
    throw Problem("the file \"" + path + "\" cannot be written");
}

}  // namespace retrograde::run_gen
