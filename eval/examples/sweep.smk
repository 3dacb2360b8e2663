# A sweep in shards under Snakemake, on this machine or on any cluster that Snakemake knows:
#
#   snakemake -s eval/examples/sweep.smk -j 4 --config plan=eval/plans/depth_s18.json out=out shards=12
#
# Options of --config: plan, out, shards; sextant (the program; build/release/bin/sextant), cpus (of a shard; 1).
# A shard that failed or was killed goes on where it was when the command is given again.
plan = config["plan"]
out = config["out"]
shards = range(1, int(config["shards"]) + 1)
sextant = config.get("sextant", "build/release/bin/sextant")


rule merge:
    input: expand(out + "/shards/{i}/run.json", i=shards)
    output: out + "/run.json"
    params: folders=[f"{out}/shards/{i}" for i in shards]
    shell: "{sextant:q} merge {params.folders:q} --out {out:q}"


# The packs once, before the shards begin.
rule packs:
    input: plan
    output: touch(out + "/packs.made")
    shell: "{sextant:q} sweep {input:q} --packs-only"


# Snakemake removes the outputs of a rule that failed, so it is told of run.json alone, and a shard keeps its journal.
rule shard:
    input: plan, out + "/packs.made"
    output: out + "/shards/{i}/run.json"
    threads: int(config.get("cpus", 1))
    params: n=len(shards), folder=lambda w: f"{out}/shards/{w.i}"
    shell: "{sextant:q} sweep {plan:q} --shard {wildcards.i}/{params.n} --out {params.folder:q} --jobs {threads} --quiet"
