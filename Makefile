# SPDX-License-Identifier: Apache-2.0
# make            builds ./st4                      make test    sets up, builds, runs every test
# make demo       sets up, builds, renders frames   make check   style and consistency, no tests
# make deps       installs the system packages that are missing
# make fuzz       fuzzes the language, for seconds=N or runs=N
# make test-stability   rays and geometry that break things; STRESS=1 scale=0.1 filter=closed_*
# make bench      structures against Embree         make bench-lang  language against C, POV-Ray
# make bench-sim  simulations against bare loops around ODE and CVODE
# make bench-instances  a million instances    make bench-others   motion blur beside POV-Ray's and Cycles'
# make bench-noise  what --noise promises, against long references
# make thesis     the tables of the thesis that it all began with
# make gallery    all examples in one picture
# config=release|debug|asan|ubsan selects flags and the folder build/$(config).

config ?= release
B := build/$(config)
CC ?= cc
CXX ?= c++

# The one list of system packages (Debian 12, Ubuntu 24.04).
PACKAGES := gcc g++ make pkg-config libopenexr-dev libopenimageio-dev libsleef-dev libassimp-dev \
            zlib1g-dev libsundials-dev libode-dev libcmocka-dev mandoc clang-format clang \
            libclang-rt-dev
# For the benchmarks alone.
BENCH_PACKAGES := libembree-dev gnuplot-nox
OTHERS_PACKAGES := povray openimageio-tools
GALLERY_PACKAGES := openimageio-tools fonts-dejavu-core

CFLAGS_release := -O2 -g
CFLAGS_debug := -O0 -g
CFLAGS_asan := -O1 -g -fsanitize=address -fno-omit-frame-pointer
CFLAGS_ubsan := -O1 -g -fsanitize=undefined -fno-sanitize-recover=undefined
# The address sanitizer looks for the C++ runtime at the start, the plugins bring it later: without
# this the first exception inside them ends the program.
LDLIBS_asan := -Wl,--no-as-needed -lstdc++
ifeq ($(CFLAGS_$(config)),)
$(error config is $(config): one of release, debug, asan, ubsan is expected)
endif

# Numbers are the same whatever the compiler: no contraction, no fast-math; FMA is written out.
WARNINGS := -Wall -Wextra -Wshadow -Wvla -Wpointer-arith -Wno-missing-field-initializers
COMMON := -I. -MMD -MP -fopenmp -fPIC -ffp-contract=off -fno-math-errno $(WARNINGS) \
          $(CFLAGS_$(config))
ALL_CFLAGS = -std=c11 -pedantic -D_XOPEN_SOURCE=700 -Wstrict-prototypes -Wmissing-prototypes \
             $(COMMON) $(CFLAGS)
ALL_CXXFLAGS = -std=c++17 $(COMMON) $(CXXFLAGS)
LDLIBS := -lOpenEXRCore-3_1 -lsleef -lz -lsundials_cvode -lsundials_nvecserial \
          -lsundials_sunnonlinsolfixedpoint -lsundials_sunlinsolspgmr -lm -ldl $(LDLIBS_$(config))

# Files that are loaded when first needed, each a shared object of its own.
ODE := render/sim_ode.c render/sim_ode_shape.c render/sim_ode_spin.c render/sim_ode_touch.c
ASSIMP := render/mesh_assimp.c render/mesh_keys.c render/mesh_motion.c render/mesh_skin.c
PLUGINS := render/image_oiio.cpp $(ASSIMP) $(ODE)
# Files named *_avx2.c and *_avx512.c are the only ones compiled for these instruction sets.
ISA_avx2 := -mavx2 -mfma -mbmi -mbmi2
ISA_avx512 := $(ISA_avx2) -mavx512f -mavx512dq -mavx512vl -mavx512bw
# In these, and in their scalar twins, loops over three axes are unrolled, so that arrays of wide
# registers do not go through memory.
KERNEL_release := -O3

FUZZ := build/fuzz

SOURCES := $(filter-out $(PLUGINS),$(wildcard accel/*.c render/*.c lang/*.c))
MAIN := lang/main.c
OBJECTS := $(SOURCES:%.c=$(B)/%.o)
LIBRARY := $(filter-out $(MAIN:%.c=$(B)/%.o),$(OBJECTS))
TESTS := $(patsubst %.c,$(B)/%.o,$(wildcard tests/*.c))
STABILITY := $(patsubst %.c,$(B)/%.o,$(wildcard tests/stability/*.c)) \
             $(B)/tests/accel_scenes.o $(B)/tests/hand_scene.o

.PHONY: all deps demo test check format clean
all: st4

st4: $(B)/st4
	@ln -sfn $(B)/st4 st4

$(B)/st4: $(OBJECTS) $(B)/st4-image.so $(B)/st4-assimp.so $(B)/st4-ode.so
	$(CC) $(ALL_CFLAGS) -o $@ $(OBJECTS) $(LDFLAGS) -Wl,--as-needed $(LDLIBS)

$(B)/st4-image.so: $(B)/render/image_oiio.o
	$(CXX) -shared $(ALL_CXXFLAGS) -o $@ $^ $(LDFLAGS) $$(pkg-config --libs OpenImageIO)

$(B)/st4-assimp.so: $(ASSIMP:%.c=$(B)/%.o) $(B)/accel/arena.o $(B)/accel/arena_array.o
	$(CC) -shared $(ALL_CFLAGS) -o $@ $^ $(LDFLAGS) -lassimp -lm

$(B)/st4-ode.so: $(ODE:%.c=$(B)/%.o)
	$(CC) -shared $(ALL_CFLAGS) -o $@ $^ $(LDFLAGS) -lode -lm

$(B)/st4-tests: $(TESTS) $(LIBRARY) | $(B)/st4-image.so $(B)/st4-assimp.so $(B)/st4-ode.so
	$(CC) $(ALL_CFLAGS) -o $@ $^ $(LDFLAGS) -lcmocka $(LDLIBS)

# Its allocations can be counted: tests/stability/counted.h.
WRAPPED := -Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=free
$(B)/st4-stability: $(STABILITY) $(LIBRARY)
	$(CC) $(ALL_CFLAGS) -o $@ $^ $(LDFLAGS) $(WRAPPED) $(LDLIBS)

$(B)/%.o: %.c Makefile
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) $(foreach isa,scalar avx2 avx512,$(if $(findstring _$(isa).c,$<),\
	    $(KERNEL_$(config)) $(ISA_$(isa)))) -c -o $@ $<

$(B)/%.o: %.cpp Makefile
	@mkdir -p $(@D)
	$(CXX) $(ALL_CXXFLAGS) $$(pkg-config --cflags OpenImageIO) -c -o $@ $<

# Installs what is missing, and says what; does nothing where all is there.
deps:
	@missing=$$(for p in $(PACKAGES) $(MORE_PACKAGES); do \
	    dpkg-query -W -f '$${Status}' $$p 2>/dev/null | grep -q 'install ok installed' || echo $$p; \
	done); \
	if [ -n "$$missing" ]; then \
	    echo "installing:" $$missing; \
	    sudo=; [ $$(id -u) = 0 ] || sudo=sudo; \
	    $$sudo apt-get update -q && \
	    DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -q -y --no-install-recommends $$missing; \
	fi

# In a second make, so that the compilers that deps installed are found.
demo: deps
	@$(MAKE) --no-print-directory st4
	@mkdir -p out
	./st4 render examples/propeller.st4 -f 1-3 --progress bar -o 'out/propeller.####.exr' \
	    -o 'out/propeller.####.png'
	@echo "the pictures are in out/:"; ls out/propeller.*

test: deps
	@$(MAKE) --no-print-directory run-tests

.PHONY: run-tests
run-tests: st4 $(B)/st4-tests $(B)/st4-stability $(FUZZ)/fuzz
	@ST4=$(B)/st4 TESTS=$(B)/st4-tests STABILITY=$(B)/st4-stability tests/run $(filter)

# 25 tests of the structures at their limits, on every structure and instruction set, in a minute.
# STRESS=1 asks 1.7e9 queries in about two hours on two processors; scale=0.1 a tenth of either,
# filter="closed_*" some of the tests, seed=1000 other rays.
.PHONY: test-stability
test-stability: $(B)/st4-stability
	@$(B)/st4-stability $(if $(filter),'$(filter)') $(if $(scale),scale=$(scale)) \
	    $(if $(seed),seed=$(seed))

# ---- Fuzzing: the whole language in one process, by clang's libFuzzer (tests/fuzz/fuzz_scene.c).
# What it finds is kept in build/fuzz/corpus, from which the next call goes on.
FUZZED := $(filter-out $(MAIN) lang/command% lang/session.c lang/options.c lang/help.c \
            lang/frame_list.c lang/sim_cache.c,$(wildcard lang/*.c)) $(wildcard render/program*.c) \
          $(filter-out render/mesh_child.c render/mesh_clips.c $(ASSIMP),$(wildcard render/mesh*.c)) \
          render/mover.c render/point_cache.c render/shutter.c render/sim_course.c \
          render/sim_solid.c render/snapshot.c render/local_time.c render/texture.c \
          render/plugin.c accel/arena_array.c accel/cpu.c
FUZZER := $(wildcard tests/fuzz/*.c)
FUZZ_OBJECTS := $(FUZZED:%.c=$(FUZZ)/%.o) $(FUZZER:%.c=$(FUZZ)/%.o)
FUZZ_SANITIZERS := address,undefined,float-cast-overflow
# Without what compares operands: the mutator knows the words, and it takes a third of the time.
FUZZ_COVERAGE := -fsanitize-coverage=inline-8bit-counters,pc-table
FUZZ_CFLAGS := -std=c11 -pedantic -D_GNU_SOURCE -I. -MMD -MP -g1 -O2 -ffp-contract=off \
               -fno-math-errno -Wall -Wno-unknown-pragmas -Wno-gnu-folding-constant -Wno-pedantic \
               -Wno-bitwise-conditional-parentheses -fno-sanitize-recover=all

$(FUZZED:%.c=$(FUZZ)/%.o): FUZZ_CFLAGS += -include tests/fuzz/fuzz_redirect.h \
    -fsanitize=$(FUZZ_SANITIZERS) $(FUZZ_COVERAGE)
$(FUZZER:%.c=$(FUZZ)/%.o): FUZZ_CFLAGS += -fsanitize=$(FUZZ_SANITIZERS)

$(FUZZ)/%.o: %.c Makefile
	@mkdir -p $(@D)
	clang $(FUZZ_CFLAGS) $(foreach isa,avx2 avx512,$(if $(findstring _$(isa).c,$<),$(ISA_$(isa)))) -c -o $@ $<

$(FUZZ)/fuzz: $(FUZZ_OBJECTS)
	clang -fsanitize=fuzzer,$(FUZZ_SANITIZERS) -Wl,--wrap=program_run -o $@ $^ -lsleef -lm -ldl

.PHONY: fuzz
fuzz: $(FUZZ)/fuzz
	@FUZZ=$(FUZZ)/fuzz tests/fuzz/run $(if $(runs),--runs $(runs)) \
	    $(if $(seconds),--seconds $(seconds)) --keep $(FUZZ)/corpus

# Structures against Embree on the same rays; obj=FILE takes the place of the procedural figure,
# bench="--scene 1 --repeats 9" passes options on.
.PHONY: bench run-bench
bench:
	@$(MAKE) --no-print-directory deps MORE_PACKAGES="$(BENCH_PACKAGES)"
	@$(MAKE) --no-print-directory run-bench

run-bench: $(B)/bench-accel
	$(B)/bench-accel $(if $(obj),--obj $(obj)) $(bench)

# A million instances, each with a clock of its own, beside duplicated data and Embree's instances;
# as a plot: out/instances.png.
.PHONY: bench-instances run-bench-instances
bench-instances:
	@$(MAKE) --no-print-directory deps MORE_PACKAGES="$(BENCH_PACKAGES)"
	@$(MAKE) --no-print-directory run-bench-instances
run-bench-instances: $(B)/bench-instances
	@mkdir -p out
	$(B)/bench-instances $(if $(obj),--obj $(obj)) --tsv out/instances.tsv $(bench)
	gnuplot -e "table='out/instances.tsv'; plot='out/instances.png'" tests/bench/instances.gp

# Deforming against a loop in C, loading against POV-Ray, where that is installed.
.PHONY: bench-lang
bench-lang: st4 $(B)/bench-lang
	@ST4=$(B)/st4 BENCH=$(B)/bench-lang tests/bench/bench_lang.sh

# Against POV-Ray's accumulated subframes and, where blender is installed, Cycles:
# tests/bench/others/compare.py names its variables.
.PHONY: bench-others
bench-others: st4
	@$(MAKE) --no-print-directory deps MORE_PACKAGES="$(OTHERS_PACKAGES)"
	@ST4=$(B)/st4 target=$(target) reference=$(reference) scenes="$(scenes)" \
	    tests/bench/others/compare.py

# Every example at its full size: out/gallery.png; spp=N samples a pixel.
.PHONY: gallery
gallery: st4
	@$(MAKE) --no-print-directory deps MORE_PACKAGES="$(GALLERY_PACKAGES)"
	@ST4=$(B)/st4 spp=$(spp) man/gallery

# Simulations against bare loops around ODE and CVODE: boxes=1000, sparks=10000 say how many.
.PHONY: bench-sim
bench-sim: st4 $(B)/bench-sim
	@ST4=$(B)/st4 BENCH=$(B)/bench-sim boxes=$(boxes) sparks=$(sparks) tests/bench/bench_sim.sh

# Errors and their estimates by --noise: tests/bench/bench_noise.sh names its variables.
.PHONY: bench-noise
bench-noise: st4
	@ST4=$(B)/st4 tests/bench/bench_noise.sh

# The thesis' tables (section 7) on this machine: tests/bench/bench_thesis.sh names its variables;
# obj=FILE takes the place of the dense mesh.
.PHONY: thesis
thesis: st4
	@ST4=$(B)/st4 obj=$(obj) size=$(size) rounds=$(rounds) counts="$(counts)" \
	    scenes="$(scenes)" tests/bench/bench_thesis.sh

$(B)/bench-lang: $(B)/tests/bench/bench_lang.o $(B)/tests/bench/deform_scene.o $(LIBRARY)
	$(CC) $(ALL_CFLAGS) -o $@ $^ $(LDFLAGS) $(LDLIBS)

$(B)/bench-instances: $(B)/tests/bench/bench_instances.o $(B)/tests/script_scene.o $(LIBRARY)
	$(CC) $(ALL_CFLAGS) -o $@ $^ $(LDFLAGS) -lembree3 $(LDLIBS)
$(B)/bench-sim: $(B)/tests/bench/bench_sim.o
	$(CC) $(ALL_CFLAGS) -o $@ $^ $(LDFLAGS) -lode $(LDLIBS)

$(B)/bench-accel: $(B)/tests/bench/bench_accel.o $(B)/tests/bench/scenes.o $(LIBRARY)
	$(CC) $(ALL_CFLAGS) -o $@ $^ $(LDFLAGS) -lembree3 $(LDLIBS)

check:
	@tests/check/all

format:
	clang-format -i $(wildcard accel/*.[ch] render/*.[ch] render/*.cpp lang/*.[ch] tests/*.[ch] \
	    tests/*/*.[ch] man/*.c stdlib/editors/*.c)

clean:
	rm -rf build st4

-include $(patsubst %.o,%.d,$(OBJECTS) $(FUZZ_OBJECTS) $(TESTS) $(STABILITY) \
    $(B)/render/image_oiio.o $(ASSIMP:%.c=$(B)/%.o) $(ODE:%.c=$(B)/%.o) \
    $(patsubst %.c,$(B)/%.o,$(wildcard tests/bench/*.c)))
