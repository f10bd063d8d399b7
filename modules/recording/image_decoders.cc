#include "recording/image_decoders.h"

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <vector>

// clang-format off
#include <jpeglib.h>  // needs <cstdio>
#include <jerror.h>   // needs jpeglib.h
#include <png.h>
// clang-format on

// Both libraries report errors by longjmp. So an object that must survive the jump is created
// before setjmp and freed after it.

namespace pangea {
namespace {

void ReadPng(png_structp png, png_bytep to, size_t size) {
  auto* rest = static_cast<std::span<const uint8_t>*>(png_get_io_ptr(png));
  if (size > rest->size()) {
    png_error(png, "it ends too early");
  }
  std::copy_n(rest->begin(), size, to);
  *rest = rest->subspan(size);
}

[[noreturn]] void OnPngError(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void OnPngWarning(png_structp, png_const_charp) {}

// Grey by Rec. 601, as cv::imread computes it.
void AskForGrey(png_structp png, png_infop info) {
  const auto type = png_get_color_type(png, info);
  png_set_strip_16(png);
  png_set_strip_alpha(png);
  png_set_expand_gray_1_2_4_to_8(png);
  if (type == PNG_COLOR_TYPE_PALETTE) {
    png_set_palette_to_rgb(png);
  }
  if ((type & PNG_COLOR_MASK_COLOR) != 0) {
    png_set_rgb_to_gray(png, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
}

// A camera writes ten scans. Each scan, however short, costs a pass over the whole image.
constexpr int kMaxScans = 100;

struct JpegErrors {
  jpeg_error_mgr base;
  std::jmp_buf leave;
};

[[noreturn]] void OnJpegError(j_common_ptr info) {
  std::longjmp(reinterpret_cast<JpegErrors*>(info->err)->leave, 1);
}

// A truncated image is an error; libjpeg would fill the missing part with grey.
void OnJpegMessage(j_common_ptr info, int level) {
  if (level < 0 && info->err->msg_code == JWRN_JPEG_EOF) {
    OnJpegError(info);
  }
}

void OnJpegProgress(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number > kMaxScans) {
    OnJpegError(info);
  }
}

}  // namespace

cv::Mat DecodePng(std::span<const uint8_t> bytes, cv::Size size) {
  cv::Mat pixels(size, CV_8U);
  std::vector<png_bytep> rows;
  for (int row = 0; row < pixels.rows; ++row) {
    rows.push_back(pixels.ptr(row));
  }
  png_structp png =
      png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, OnPngError, OnPngWarning);
  png_infop info = png_create_info_struct(png);
  if (png == nullptr || info == nullptr) {
    png_destroy_read_struct(&png, &info, nullptr);
    return {};
  }
  if (setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_read_struct(&png, &info, nullptr);
    return {};
  }
  // Text chunks are dropped, because each of them may unpack to 8 MB.
  png_set_chunk_cache_max(png, 1);
  png_set_read_fn(png, &bytes, ReadPng);
  png_read_info(png, info);
  AskForGrey(png, info);
  if (png_get_rowbytes(png, info) != static_cast<size_t>(size.width) ||
      png_get_image_height(png, info) != static_cast<png_uint_32>(size.height)) {
    png_error(png, "another size than its header says");
  }
  png_read_image(png, rows.data());
  png_read_end(png, nullptr);
  png_destroy_read_struct(&png, &info, nullptr);
  return pixels;
}

cv::Mat DecodeJpeg(std::span<const uint8_t> bytes, cv::Size size) {
  cv::Mat pixels(size, CV_8U);
  jpeg_decompress_struct jpeg{};
  JpegErrors errors{};
  jpeg_progress_mgr progress{};
  progress.progress_monitor = OnJpegProgress;
  jpeg.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = OnJpegError;
  errors.base.emit_message = OnJpegMessage;
  jpeg_create_decompress(&jpeg);
  if (setjmp(errors.leave) != 0) {
    jpeg_destroy_decompress(&jpeg);
    return {};
  }
  jpeg.progress = &progress;
  jpeg_mem_src(&jpeg, bytes.data(), bytes.size());
  jpeg_read_header(&jpeg, TRUE);
  jpeg.out_color_space = JCS_GRAYSCALE;
  jpeg_start_decompress(&jpeg);
  if (jpeg.output_width != static_cast<JDIMENSION>(size.width) ||
      jpeg.output_height != static_cast<JDIMENSION>(size.height)) {
    OnJpegError(reinterpret_cast<j_common_ptr>(&jpeg));
  }
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW row = pixels.ptr(static_cast<int>(jpeg.output_scanline));
    jpeg_read_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_decompress(&jpeg);
  jpeg_destroy_decompress(&jpeg);
  return pixels;
}

}  // namespace pangea
