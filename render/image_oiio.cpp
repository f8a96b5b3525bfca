// SPDX-License-Identifier: Apache-2.0
// Images other than EXR by OpenImageIO: the only C++ here, a thin shell with a fence around it.
#include "render/image_oiio.h"

#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

struct ImageOiioFile {
    std::unique_ptr<OIIO::ImageInput> input;
};

namespace {

constexpr int side_limit = 65536, channel_limit = 1024;
constexpr uint64_t value_limit = uint64_t(1) << 32;

// The library's sentences, often several lines, as one.
bool fail(char *message, size_t n, const std::string &why) {
    std::string line = why.substr(0, why.find('\n'));
    std::snprintf(message, n, "%s", line.empty() ? "unknown reason" : line.c_str());
    return false;
}

// Runs body, which returns whether it went well; what it throws becomes the message.
template <typename Body> bool fenced(char *message, size_t n, Body body) noexcept {
    try {
        return body();
    } catch (const std::exception &e) {
        std::snprintf(message, n, "%s", e.what());
    } catch (...) {
        std::snprintf(message, n, "unknown reason");
    }
    return false;
}

bool write(const char *format, const uint8_t *pixels, uint32_t width, uint32_t height,
           uint32_t n_channels, ImageOiioSink *sink, void *context, char *message, size_t n) {
    return fenced(message, n, [&] {
        auto output = OIIO::ImageOutput::create(format);
        if (!output) {
            return fail(message, n, OIIO::geterror());
        }
        if (n_channels == 4 && !output->supports("alpha")) {
            return fail(message, n, std::string(format) + " files hold no alpha");
        }
        OIIO::ImageSpec spec(int(width), int(height), int(n_channels), OIIO::TypeDesc::UINT8);
        // In TIFF this is an EXIF directory, which in memory the library puts in place of the
        // picture's own (2.4); readers take 8 bits for sRGB without it.
        if (std::strncmp(format, "tif", 3) != 0) {
            spec.attribute("oiio:ColorSpace", "sRGB");
        }
        spec.attribute("oiio:UnassociatedAlpha", 1);
        spec.attribute("CompressionQuality", 95);
        spec.attribute("jpeg:subsampling", "4:4:4");
        std::vector<unsigned char> bytes;
        OIIO::Filesystem::IOVecOutput memory(bytes);
        bool done = output->set_ioproxy(&memory) &&
                    output->open(std::string("memory.") + format, spec) &&
                    output->write_image(OIIO::TypeDesc::UINT8, pixels);
        // Closing writes what is buffered, so its failure counts too.
        done = output->close() && done;
        return done ? sink(context, bytes.data(), bytes.size())
                    : fail(message, n, output->geterror());
    });
}

bool check_size(const OIIO::ImageSpec &spec, char *message, size_t n) {
    if (spec.width < 1 || spec.height < 1 || spec.width > side_limit || spec.height > side_limit ||
        spec.depth > 1) {
        return fail(message, n, "the image is not 1 to 65536 pixels a side");
    }
    if (spec.nchannels < 1 || spec.nchannels > channel_limit || spec.deep) {
        return fail(message, n, "the image has no channels, too many, or deep ones");
    }
    if (uint64_t(spec.width) * spec.height * spec.nchannels > value_limit) {
        return fail(message, n, "the image takes more than 16 GiB");
    }
    return true;
}

// 8 bits are sRGB whatever the file says; 16 bits when it says so.
bool is_srgb(const OIIO::ImageSpec &spec) {
    return spec.format == OIIO::TypeDesc::UINT8 ||
           (spec.format == OIIO::TypeDesc::UINT16 &&
            spec.get_string_attribute("oiio:ColorSpace") == "sRGB");
}

ImageOiioFile *open(const char *path, ImageOiioInfo *info, char *message, size_t n) {
    std::unique_ptr<ImageOiioFile> file;
    bool done = fenced(message, n, [&] {
        OIIO::ImageSpec config;
        // Left to itself the library multiplies by alpha on the sRGB curve.
        config.attribute("oiio:UnassociatedAlpha", 1);
        file = std::make_unique<ImageOiioFile>();
        file->input = OIIO::ImageInput::open(path, &config);
        if (!file->input) {
            return fail(message, n, OIIO::geterror());
        }
        const OIIO::ImageSpec &spec = file->input->spec();
        if (!check_size(spec, message, n)) {
            return false;
        }
        *info = {uint32_t(spec.width), uint32_t(spec.height), uint32_t(spec.nchannels),
                 is_srgb(spec), spec.get_int_attribute("oiio:UnassociatedAlpha") != 0};
        return true;
    });
    return done ? file.release() : nullptr;
}

const char *channel_name(const ImageOiioFile *file, uint32_t channel) {
    const auto &names = file->input->spec().channelnames;
    return channel < names.size() ? names[channel].c_str() : "";
}

bool read(ImageOiioFile *file, float *values, char *message, size_t n) {
    return fenced(message, n, [&] {
        int all = file->input->spec().nchannels;
        return file->input->read_image(0, 0, 0, all, OIIO::TypeDesc::FLOAT, values)
                   ? true
                   : fail(message, n, file->input->geterror());
    });
}

void close(ImageOiioFile *file) {
    char unused[8];
    fenced(unused, sizeof unused, [&] {
        delete file;
        return true;
    });
}

} // namespace

const ImageOiio image_oiio = {write, open, channel_name, read, close};
