// SPDX-License-Identifier: Apache-2.0
// Images other than EXR, and textures, by OpenImageIO: the only C++ here, a thin shell with a fence
// around it.
#include "render/image_oiio.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/texture.h>

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
    char unused[16];
    fenced(unused, sizeof unused, [&] {
        delete file;
        return true;
    });
}

// ---- Textures

float srgb_to_linear(float x) {
    return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f);
}

// A file as the texture system sees it: red, green, blue and opacity of linear light, whatever it
// holds, so that what is filtered is light. Called "raw:PATH" it is left as it is.
class LinearInput : public OIIO::ImageInput {
  public:
    const char *format_name() const override {
        return "linear";
    }

    bool open(const std::string &name, OIIO::ImageSpec &spec) override {
        OIIO::ImageSpec config;
        config.attribute("oiio:UnassociatedAlpha", 1);
        inner = OIIO::ImageInput::open(name.substr(4), &config);
        if (!inner) {
            errorfmt("{}", OIIO::geterror());
            return false;
        }
        const OIIO::ImageSpec &own = inner->spec();
        char message[256];
        if (!check_size(own, message, sizeof message)) {
            errorfmt("{}", message);
            return false;
        }
        decodes = name[0] != 'r' && is_srgb(own);
        divides = own.alpha_channel >= 0 && own.get_int_attribute("oiio:UnassociatedAlpha") == 0;
        bool is_small = own.format == OIIO::TypeDesc::UINT8 || own.format == OIIO::TypeDesc::HALF;
        m_spec = OIIO::ImageSpec(own.width, own.height, 4,
                                 is_small ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
        m_spec.attribute("oiio:ColorSpace", "Linear");
        spec = m_spec;
        return true;
    }

    bool close() override {
        inner.reset();
        whole.clear();
        return true;
    }

    bool seek_subimage(int subimage, int miplevel) override {
        return subimage == 0 && miplevel == 0;
    }

    bool read_native_scanline(int, int, int y, int, void *data) override {
        const OIIO::ImageSpec &own = inner->spec();
        std::vector<float> row;
        const float *from = scanline(y, row);
        if (!from) {
            errorfmt("{}", inner->geterror());
            return false;
        }
        std::vector<float> to(size_t(own.width) * 4);
        for (int x = 0; x < own.width; x++) {
            convert(from + size_t(x) * own.nchannels, &to[size_t(x) * 4]);
        }
        return OIIO::convert_image(4, own.width, 1, 1, to.data(), OIIO::TypeDesc::FLOAT,
                                   OIIO::AutoStride, OIIO::AutoStride, OIIO::AutoStride, data,
                                   m_spec.format, OIIO::AutoStride, OIIO::AutoStride,
                                   OIIO::AutoStride);
    }

  private:
    std::unique_ptr<OIIO::ImageInput> inner;
    std::vector<float> whole; // of a file in tiles
    bool decodes = false, divides = false;

    const float *scanline(int y, std::vector<float> &row) {
        const OIIO::ImageSpec &own = inner->spec();
        size_t width = size_t(own.width) * own.nchannels;
        if (own.tile_width == 0) {
            row.resize(width);
            bool done = inner->read_scanline(own.y + y, 0, OIIO::TypeDesc::FLOAT, row.data());
            return done ? row.data() : nullptr;
        }
        if (whole.empty()) {
            whole.resize(width * own.height);
            if (!inner->read_image(0, 0, 0, own.nchannels, OIIO::TypeDesc::FLOAT, whole.data())) {
                whole.clear();
                return nullptr;
            }
        }
        return &whole[width * y];
    }

    void convert(const float *from, float *to) const {
        const OIIO::ImageSpec &own = inner->spec();
        bool is_gray = own.nchannels - (own.alpha_channel >= 0) < 3;
        float alpha = own.alpha_channel >= 0 ? from[own.alpha_channel] : 1;
        for (int c = 0; c < 3; c++) {
            float value = from[is_gray ? 0 : c];
            value = divides && alpha > 0 ? value / alpha : value;
            to[c] = decodes ? srgb_to_linear(value) : value;
        }
        to[3] = alpha;
    }
};

OIIO::ImageInput *linear_input() {
    return new LinearInput;
}

OIIO::ImageCache *cache = nullptr;
OIIO::TextureSystem *textures = nullptr;

// Made by the one thread that loads the scene.
void make_textures() {
    if (!textures) {
        cache = OIIO::ImageCache::create(false);
        cache->attribute("autotile", 64);
        cache->attribute("automip", 1);
        cache->attribute("max_memory_MB", 256.0f);
        textures = OIIO::TextureSystem::create(false, cache);
    }
}

// at: as ImageOiio's look_up.
bool look_up_texture(ImageOiioTexture *texture, const float at[6], float rgba[4]) {
    OIIO::TextureOpt options;
    options.swrap = options.twrap = OIIO::TextureOpt::WrapPeriodic;
    options.interpmode = OIIO::TextureOpt::InterpBilinear;
    options.mipmode = OIIO::TextureOpt::MipModeAniso;
    options.anisotropic = 16;
    auto handle = reinterpret_cast<OIIO::TextureSystem::TextureHandle *>(texture);
    return textures->texture(handle, textures->get_perthread_info(), options, at[0], 1 - at[1],
                             at[2], -at[3], at[4], -at[5], 4, rgba);
}

ImageOiioTexture *open_texture(const char *path, bool is_raw, char *message, size_t n) {
    ImageOiioTexture *texture = nullptr;
    fenced(message, n, [&] {
        make_textures();
        OIIO::ustring name((is_raw ? "raw:" : "lin:") + std::string(path));
        cache->add_file(name, linear_input);
        auto handle = textures->get_texture_handle(name);
        // The smallest picture of the pyramid is made of all of the file.
        const float all[6] = {0.5f, 0.5f, 1, 0, 0, 1};
        float rgba[4];
        auto found = reinterpret_cast<ImageOiioTexture *>(handle);
        if (!handle || !textures->good(handle) || !look_up_texture(found, all, rgba)) {
            std::string why = textures->geterror();
            return fail(message, n, why.empty() ? cache->geterror() : why);
        }
        texture = found;
        return true;
    });
    return texture;
}

void look_up(ImageOiioTexture *texture, const float at[6], float rgba[4]) {
    char unused[16];
    if (!fenced(unused, sizeof unused, [&] { return look_up_texture(texture, at, rgba); })) {
        textures->geterror(); // nobody reads it, and it would grow
        std::memset(rgba, 0, 4 * sizeof *rgba);
    }
}

void set_texture_memory(size_t bytes) {
    char unused[16];
    fenced(unused, sizeof unused,
           [&] { return !cache || cache->attribute("max_memory_MB", float(bytes) / (1 << 20)); });
}

} // namespace

const ImageOiio image_oiio = {write, open,         channel_name, read,
                              close, open_texture, look_up,      set_texture_memory};
