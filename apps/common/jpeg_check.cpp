// jpeg_check.cpp -- see jpeg_check.h. libjpeg reports errors by longjmp, because exceptions cannot pass through C:
// between setjmp and the jump no object with a destructor is created.
#include "common/jpeg_check.h"

#include <csetjmp>
#include <cstdio>
#include <memory>
#include <vector>

#include <jpeglib.h>

#include <jerror.h>

namespace apps {

namespace {

// Warnings after which the decoder invents samples. Others, for example about bytes between segments, are harmless.
bool is_damage(int warning) {
  return warning == JWRN_JPEG_EOF || warning == JWRN_HIT_MARKER || warning == JWRN_HUFF_BAD_CODE ||
         warning == JWRN_ARITH_BAD_CODE || warning == JWRN_MUST_RESYNC;
}

struct Decoder {
  jpeg_decompress_struct codec = {};
  jpeg_error_mgr manager = {};
  std::jmp_buf back;
  char message[JMSG_LENGTH_MAX] = "";  // the first message
  ~Decoder() { jpeg_destroy_decompress(&codec); }
};

void note(j_common_ptr codec) {
  auto* decoder = static_cast<Decoder*>(codec->client_data);
  if (!*decoder->message) codec->err->format_message(codec, decoder->message);
}

[[noreturn]] void give_up(j_common_ptr codec) {
  note(codec);
  std::longjmp(static_cast<Decoder*>(codec->client_data)->back, 1);
}

void note_damage(j_common_ptr codec, int level) {
  if (level < 0 && is_damage(codec->err->msg_code)) note(codec);
}

// Without colour conversion. client_data survives jpeg_create_*, which clears the other fields.
bool start(Decoder& decoder, std::FILE* file) {
  jpeg_decompress_struct& codec = decoder.codec;
  codec.err = jpeg_std_error(&decoder.manager);
  decoder.manager.error_exit = give_up;
  decoder.manager.emit_message = note_damage;
  codec.client_data = &decoder;
  if (setjmp(decoder.back)) return false;
  jpeg_create_decompress(&codec);
  jpeg_stdio_src(&codec, file);
  jpeg_read_header(&codec, TRUE);
  codec.out_color_space = codec.jpeg_color_space;
  codec.dct_method = JDCT_IFAST;
  codec.scale_num = 1;
  codec.scale_denom = 8;
  jpeg_start_decompress(&codec);
  return true;
}

void read_lines(Decoder& decoder, uint8_t* samples) {
  if (setjmp(decoder.back)) return;
  while (decoder.codec.output_scanline < decoder.codec.output_height) {
    JSAMPROW line = samples;
    jpeg_read_scanlines(&decoder.codec, &line, 1);
  }
  jpeg_finish_decompress(&decoder.codec);
}

}  // namespace

std::string jpeg_damage(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             std::fclose);
  if (!file) return "it cannot be opened";
  Decoder decoder;
  if (!start(decoder, file.get())) return decoder.message;
  const auto components = static_cast<size_t>(decoder.codec.output_components);
  std::vector<uint8_t> line(components * decoder.codec.output_width);
  read_lines(decoder, line.data());
  return decoder.message;
}

}  // namespace apps
