# Maquette: one command for each thing a developer does. `make` alone lists them.
#
# Every target installs what it needs (Debian packages, pinned Python packages, ONNX Runtime), and does so once:
# stamps under build/ and .venv/ keep repeated runs quick.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

JOBS ?= $(shell nproc)
OUT ?= demo-output
PYTHON ?= python3
export PYTHON
# Newer ONNX Runtime libraries than the pinned one write telemetry files unless told not to.
export ORT_DISABLE_TELEMETRY := 1

.PHONY: help
help:  ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/  make \1\t\2/' | expand -t 20

.PHONY: demo
demo: build  ## dense pose on a bundled photo and clip, a moving body, what the clip shows next, a turning head, flights through a room and a real box, into demo-output/ (no torch)
	@scripts/demo.sh $(OUT)

.PHONY: build
build: packages-demo  ## configure and build the SDK and its command line (release)
	@JOBS=$(JOBS) scripts/build.sh release $(if $(wildcard build/release/CMakeCache.txt),,-DMAQ_BUILD_TESTS=OFF)

WHEELS ?= $(shell uname -m)
.PHONY: wheel
wheel: packages-wheel  ## Python packages for Linux with glibc 2.28 and newer, into build/wheel; WHEELS="x86_64 aarch64" for both
	@$(if $(filter aarch64,$(WHEELS)),scripts/install-packages.sh isa)
	@scripts/make-venv.sh
	@JOBS=$(JOBS) scripts/make-wheel.sh $(WHEELS)

.PHONY: desktop-demo
desktop-demo: packages-desktop build  ## the webcam demo with a window: builds it and starts it
	@JOBS=$(JOBS) scripts/build.sh release -DMAQ_BUILD_DESKTOP_DEMO=ON maquette_demo
	@build/release/stage/bin/maquette-demo

.PHONY: test
test: packages-test  ## native tests, Python tests and programs of users, with the release build; ends with "N passed, N failed"
	@JOBS=$(JOBS) scripts/test.sh

.PHONY: test-all
test-all: packages-test-all  ## `test`, and sanitizers, aarch64 emulated, Android, browsers, cameras in a virtual machine
	@JOBS=$(JOBS) scripts/test.sh python camera-vm aarch64 android web asan tsan release

.PHONY: test-isa
test-isa: build packages-test  ## native tests and labels on aarch64 and on AVX2 without VNNI, emulated; a part of it is in `test-all`
	@scripts/make-venv.sh
	@JOBS=$(JOBS) scripts/build.sh release -DMAQ_BUILD_TESTS=ON processor_features
	@scripts/test-isa.sh $(JOBS)

.PHONY: test-camera-vm
test-camera-vm: packages-test build  ## camera tests on a real kernel in qemu, with test cameras; part of `test-all`
	@tests/camera_vm/run.sh

.PHONY: test-windows
test-windows: packages-windows build  ## the SDK for Windows without cameras, and its results under Wine beside those of Linux; not part of `test-all`
	@scripts/windows/test.sh $(JOBS)

.PHONY: test-hostile
test-hostile: packages-test build  ## some 4,000 hostile inputs to the built program: crashes, hangs, unclear errors; not part of `test-all`
	@scripts/make-venv.sh
	@.venv/bin/python -m tests.hostile --json build/hostile.json

.PHONY: test-glb
test-glb: build  ## heads and bodies as .glb by the Khronos validator and in three.js; needs node and npm; not part of `test-all`
	@scripts/test-glb.sh

.PHONY: test-splats
test-splats: build  ## splats as .ply, .spz and .glb by splat-transform and the Khronos validator; needs node and npm; not part of `test-all`
	@scripts/test-splats.sh

FUZZ_SECONDS ?= 600
.PHONY: fuzz
fuzz: packages-fuzz  ## each fuzz target for FUZZ_SECONDS (libFuzzer, sanitizers), one on each core; a few seconds of each are in `test-all`
	@JOBS=$(JOBS) scripts/build.sh fuzz
	@tests/native/fuzz/run.sh $(FUZZ_SECONDS) $(JOBS) $(FUZZ_TARGETS)

SOAK_SECONDS ?= 600
.PHONY: soak
soak: build packages-test  ## all systems in one process for SOAK_SECONDS; memory, files, threads and times in build/soak/soak.svg
	@scripts/make-venv.sh
	@JOBS=$(JOBS) scripts/build.sh release -DMAQ_BUILD_TESTS=ON soak
	@.venv/bin/python -m tests.soak --seconds $(SOAK_SECONDS)

.PHONY: android
android: build  ## the AAR for Android apps with its size report, into build/android; without the NDK, as a check (android/README.md)
	@scripts/install-packages.sh android
	@scripts/android/build.sh $(JOBS)

.PHONY: test-android
test-android: android  ## the AAR's parts, the Kotlin API on this machine's Java, and native tests on aarch64, emulated; part of `test-all`
	@JOBS=$(JOBS) scripts/build.sh release -DMAQ_BUILD_TESTS=ON -DMAQ_BUILD_JNI=ON maquette_jni processor_features
	@scripts/android/test.sh
	@scripts/make-venv.sh
	@scripts/test-isa.sh $(JOBS) core || [ $$? -eq 77 ]

.PHONY: test-newcomer
test-newcomer:  ## the commands of README.md in a bare Debian, from top to bottom; needs root; not part of `test-all`
	@scripts/install-packages.sh newcomer
	@$(PYTHON) -m tests.newcomer

.PHONY: web
web: packages-web  ## dense pose for browsers and node: the npm package and a page, into build/web (web/README.md)
	@scripts/web/build.sh $(JOBS)

.PHONY: test-web
test-web: web packages-test build  ## the npm package in node and the page in Chromium, beside the native library; part of `test-all`
	@scripts/web/test.sh

.PHONY: release
release: build wheel android  ## all packages with checksums, signature and SBOM, into build/dist (docs/reference/packages.md)
	@scripts/install-packages.sh release
	@scripts/release/build.sh

.PHONY: test-release
test-release: packages-test  ## unpacks build/dist; checks signature, checksums, SBOM, lintian, and runs its program; not part of `test-all`
	@scripts/install-packages.sh release
	@scripts/make-venv.sh dev,release
	@.venv/bin/python -m pytest tests/release

.PHONY: test-reproducible
test-reproducible: packages-demo  ## builds the library in two folders and compares all files; 6.5 minutes of processor time; not part of `test-all`
	@JOBS=$(JOBS) scripts/release/reproducible.sh

.PHONY: site
site:  ## guides and API reference as web pages, into build/site, and a check of all their links; not part of `test-all`
	@scripts/install-packages.sh site
	@scripts/make-venv.sh dev,site
	@.venv/bin/python scripts/site/build.py
	@.venv/bin/python -m pytest tests/site

.PHONY: test-wheel
test-wheel:  ## the wheels of `make wheel` in bare Debian 11, 12 and 13, beside the release build; needs root; not part of `test-all`
	@scripts/install-packages.sh newcomer
	@scripts/make-venv.sh
	@$(PYTHON) -m tests.wheel

.PHONY: bench-data
bench-data: build packages-test  ## data that `make bench` measures on: photographs, rendered people, places, solids (half an hour, once)
	@scripts/make-venv.sh train,teachers,solids,captures,clips
	@.venv/bin/python -m benchmarks.data

.PHONY: bench
bench: build packages-test  ## speed, size and error against benchmarks/targets.toml; a report in build/benchmarks
	@scripts/make-venv.sh train,bench
	@JOBS=$(JOBS) scripts/build.sh release -DMAQ_BUILD_TESTS=ON measure_startup measure_live_source measure_live_scene \
	    measure_frame_budget measure_edges measure_prediction find_motion print_solids_truth extract_edge_curves
	@.venv/bin/python -m benchmarks

.PHONY: format
format: packages-lint  ## rewrite C++ (clang-format) and Python (ruff) sources in the house layout
	@scripts/make-venv.sh dev
	@git ls-files -co --exclude-standard '*.h' '*.hpp' '*.c' '*.cpp' | xargs -r clang-format -i
	@.venv/bin/ruff format . && .venv/bin/ruff check --fix .

# clang-tidy checks 16 files as one, because it reads their headers once then.
.PHONY: lint
lint: packages-lint packages-test  ## check layout and lint rules without changing anything
	@git ls-files -co --exclude-standard '*.h' '*.hpp' '*.c' '*.cpp' | xargs -r clang-format --dry-run --Werror
	@! LC_ALL=C.UTF-8 git grep -nE '^.{121}' -- '*.h' '*.hpp' '*.c' '*.cpp' || { echo "Lines have at most 120 characters." >&2; exit 1; }
	@scripts/make-venv.sh dev & venv=$$!; trap wait EXIT; \
	    cmake --preset debug -B build/lint -DMAQ_BUILD_TESTS=ON -DMAQ_UNITY_FILES=16 >/dev/null; \
	    git ls-files -co --exclude-standard 'sdk/src/*.cpp' 'sdk/app/*.cpp' 'sdk/tools/*.cpp' 'desktop_demo/src/*.cpp' \
	        | xargs -r $(PYTHON) scripts/clang_tidy.py --build build/lint; \
	    wait $$venv
	@.venv/bin/ruff format --check . && .venv/bin/ruff check .

.PHONY: clean
clean:  ## remove builds and demo output (keeps fetched packages, data and .venv)
	@rm -rf build demo-output

.PHONY: packages-demo packages-desktop packages-test packages-lint packages-fuzz packages-wheel packages-windows packages-web packages-test-all
packages-demo packages-desktop packages-test packages-lint packages-fuzz packages-wheel packages-windows packages-web: packages-%:
	@scripts/install-packages.sh $*

packages-test-all:  # a group whose packages cannot be installed prints why it is not run
	@scripts/install-packages.sh test isa camera-vm android web || scripts/install-packages.sh test
