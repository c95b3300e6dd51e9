# CrunchBot's front door. `make help` lists what there is.
SEED ?= 1
COUNT ?= 300
LEVEL ?= bytes
BUILD := build/release
PYTHON := .venv/bin/python
SOURCES_C = $(shell git ls-files '*.c' '*.h' '*.cpp' | grep -v '/gen/')

.PHONY: help demo demo-rtl demo-map demo-long test test-all test-kernel test-hil mutants bench wheels wheels-check debian release release-offline release-check sbom build build-demo setup setup-demo setup-tests example-data docs gen firmware firmware-images firmware-check flash bitstream format lint clean

help: ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

# Matrices are small here: a second thread of NumPy's library mostly waits, at full load, and changes the order of sums.
demo demo-rtl demo-map demo-long test test-all mutants: export OPENBLAS_NUM_THREADS = 1

demo: build-demo ## the whole chain on simulated hardware, magnet to pose: about half a minute; SEED=n chooses the seed
	@$(PYTHON) -m crunchbot_lab.demo --out build/demo --build-dir $(BUILD) --seed $(SEED)

demo-rtl: build-demo ## the same with every clock cycle of the bridge simulated, not only those of the first seconds: about a minute
	@$(PYTHON) -m crunchbot_lab.demo --out build/demo --build-dir $(BUILD) --seed $(SEED) --level rtl

demo-map: build-demo ## the whole robot maps an unknown arena for 300 s, then finds itself in its own map: about three minutes; SEED=n
	@$(PYTHON) -m crunchbot_lab.demo.mapping --out build/demo-map --build-dir $(BUILD) --seed $(SEED)

demo-long: build-demo ## 30 simulated minutes of the whole robot, with a report; SEED=n; LEVEL=bytes, or signals (a minute), or rtl
	@$(PYTHON) -m crunchbot_lab.demo.long --out build/demo-long --build-dir $(BUILD) --seed $(SEED) --level $(LEVEL)

test: setup-tests build lint ## everything that fits in 15 minutes on two cores
	@tools/run_tests.sh $(BUILD)

test-all: test ## and what is long: sanitizers over the whole tree, longer fuzzing
	@tools/run_tests.sh --long

test-kernel: build ## a stock Debian kernel in QEMU meets the simulated bridge, and systemd the services: five minutes and more
	@WHISKER_BUILD=$(BUILD) $(PYTHON) tests/kernel/run.py

test-hil: build ## hardware in the loop: a plugged bridge, a base: BASE=port [MODEL=2] [WHEELS_UP=1] [INTERACTIVE=1]
	@WHISKER_BUILD=$(BUILD) $(PYTHON) tests/hil/run.py $(if $(BASE),--base "$(BASE)") $(if $(MODEL),--model "$(MODEL)") \
		$(if $(WHEELS_UP),--wheels-up) $(if $(INTERACTIVE),--interactive)

mutants: build ## change COUNT=300 lines at random, one at a time, and count what the tests notice; hours, resumable; SEED=n
	@PYTHONPATH=tests $(PYTHON) -m mutants --count $(COUNT) --seed $(SEED)

bench: build ## measure speed and accuracy again, resumable: bench/results, docs/charts; WHOLE=1: full sizes, many hours
	@$(PYTHON) tools/benches --build-dir $(BUILD) $(if $(WHOLE),--whole)

wheels: build ## Python wheels into dist/: abi3 for x86-64 and aarch64, and the simulation's programs
	@$(PYTHON) tools/wheels --build-dir $(BUILD)

wheels-check: wheels ## the wheels as users get them: empty environments, a simulated robot, aarch64 by emulation
	@$(PYTHON) tools/wheels/check.py

debian: ## Debian packages into dist/debian, built in and tried in roots of their own: [RELEASES="bookworm trixie"]; as root
	@python3 tools/debian $(RELEASES)

release: build sbom ## what users download, into dist/: wheels, Debian packages, bitstreams, images, site, RELEASE.md, SHA256SUMS; [BOARDS="a b"] [USB_ID=vid:pid]
	@$(PYTHON) tools/release $(if $(BOARDS),--boards $(BOARDS)) $(if $(USB_ID),--usb-id "$(USB_ID)")

release-offline: ## each remedy that names a package, against the files of dist/ alone: make release, or make wheels, before
	@WHISKER_DIST=dist $(PYTHON) -m pytest --quiet tests/repository/test_remedies.py

release-check: build sbom ## make a release twice and compare every byte; [BOARDS="a b"]
	@$(PYTHON) tools/release --twice $(if $(BOARDS),--boards $(BOARDS)) $(if $(USB_ID),--usb-id "$(USB_ID)")

sbom: build ## the software bill of materials: build/sbom.json (CycloneDX)
	@$(PYTHON) tools/sbom.py --build-dir $(BUILD)

build-demo: setup-demo ## compile what the demos and the command line run, into the same folder
	@tools/build.sh $(BUILD) demo

build: setup ## compile libraries, daemon, firmware core, simulated bridge and the Python modules
	@tools/build.sh $(BUILD)

setup: ## install what the build lacks: Debian packages, locked Python packages
	@tools/setup.sh

setup-demo: ## only what the demos and the command line need
	@tools/setup.sh --demo

setup-tests: ## and what the tests need besides: clang, spin, compiler and simulator for AVR
	@tools/setup.sh --tests

example-data: build ## make the data set of `whisker examples` again: host/python/crunchbot/data
	@$(PYTHON) tools/example_data.py

docs: build ## pages and API of C and Python as a site, every warning an error: build/site/html; [EXTERNAL=1] tries addresses outside
	@command -v doxygen >/dev/null || { if [ "$$(id -u)" -eq 0 ]; then SUDO=; else SUDO=sudo; fi; \
		$$SUDO apt-get install -y -qq doxygen >/dev/null || { echo "docs: Doxygen could not be installed; run: apt-get install doxygen" >&2; exit 1; }; }
	@cd tools && ../$(PYTHON) -m handbook --build-dir ../$(BUILD) $(if $(EXTERNAL),--external)

gen: setup ## regenerate protocol/gen from protocol/whisker.toml
	@$(PYTHON) tools/protogen.py

firmware: ## build the node's firmware with XC16 or XC-DSC, or PIC30=DIR, a public build of the compiler
	@tools/firmware/build.sh

firmware-images: ## make the committed image again, twice: PIC30=DIR
	@tools/firmware/images.sh

firmware-check: build ## execute the node's image against the firmware's C, at length; or IMAGE=node_wire.hex, built by anyone
	@WHISKER_BUILD=$(BUILD) WHISKER_IMAGE_LONG=1 WHISKER_IMAGE="$(abspath $(IMAGE))" $(PYTHON) -m pytest --quiet tests/rigs/node_image

flash: ## first programming of a node by wire, no compiler needed: TOOL=ipecmd|pk2cmd|picberry SERIAL=n [HEX=file]
	@tools/firmware/flash.sh --tool "$(TOOL)" $(if $(SERIAL),--serial "$(SERIAL)") $(if $(HEX),--hex "$(HEX)")

bitstream: setup ## the bridge for a board one can buy: BOARD=ecpix5|colorlight_i9|colorlight_i5|cynthion|tang_primer_20k|ulx3s [LANES=n] [SEED=n] [SERIAL=text] [USB_ID=vid:pid]
	@$(PYTHON) fpga/boards/build.py "$(BOARD)" --seed $(SEED) $(if $(LANES),--lanes "$(LANES)") $(if $(SERIAL),--serial "$(SERIAL)") \
		$(if $(USB_ID),--usb-id "$(USB_ID)")

format: setup ## format C, C++ and Python
	@.venv/bin/clang-format -i $(SOURCES_C)
	@.venv/bin/ruff format --quiet .

lint: setup ## formats, Python lint, and the guards of tools/lint: arrows, budgets, circles, folders, names, words, pages
	@.venv/bin/clang-format --dry-run --Werror $(SOURCES_C)
	@.venv/bin/ruff format --quiet --check . || { echo "lint: Python is not formatted; run 'make format'" >&2; exit 1; }
	@.venv/bin/ruff check --quiet .
	@cd tools && ../$(PYTHON) -m lint

clean: ## remove what was built (not .venv)
	@rm -rf build host/python/crunchbot/_native* lab/crunchbot_lab/signals/_sim*
