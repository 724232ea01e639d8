"""The report's page; jinja2, no outside resources."""

TEMPLATE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Discovery: {{ verdict }}</title>
<style>
body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}
h1{font-size:1.35rem;line-height:1.35;border-left:.4rem solid #2b5f9e;padding-left:.8rem}
h2{font-size:1.1rem;margin-top:2.2rem;border-bottom:1px solid #ddd}
table{border-collapse:collapse;margin:.6rem 0}td,th{padding:.2rem .8rem;text-align:right;border-bottom:1px solid #eee}
td:first-child,th:first-child,td.l,th.l{text-align:left}svg{max-width:100%;height:auto}
.note{background:#fff6e0;padding:.4rem .8rem;margin:.3rem 0}.outside td{color:#888}
pre{background:#f5f5f5;padding:.8rem;overflow-x:auto;font-size:.85rem}details{margin:.6rem 0}
</style></head><body>
<h1>{{ sentence }}</h1>
<p>Verdict: <b>{{ verdict }}</b>. Run {{ run.source or "(unnamed)" }}, {{ "%.1f"|format(run.seconds) }} s; model {{ run.model }}.
{% if interrupted %}<b>The search was interrupted: this is what was known by then.</b>{% endif %}</p>
{% for note in notes %}<div class="note">{{ note }}</div>{% endfor %}
{% for e in effects %}
<h2>{{ e.title }}</h2>
<p>{{ e.sentence }} Confidence {{ e.confidence }} %: {{ e.why }}.
{% if e.alternatives %}<b>These data cannot tell it from: {{ e.alternatives }}.</b>{% endif %}</p>
{% if e.parameters %}<table><tr><th>parameter</th><th>value</th><th>95 % from</th><th>to</th><th>unit</th><th class="l">meaning</th></tr>
{% for p in e.parameters %}<tr><td>{{ p.name }}</td><td>{{ p.value }}</td><td>{{ p.low }}</td><td>{{ p.high }}</td><td>{{ p.unit }}</td>
<td class="l">{{ p.meaning }}</td></tr>{% endfor %}</table>{% endif %}
{% if e.check %}<p><b>Check on the rig:</b> {{ e.check }}</p>{% endif %}
{% if e.source %}<p>Form: {{ e.source }}.</p>{% endif %}
{% endfor %}
{% if experiment %}<h2>Next experiment</h2><p>{{ experiment.why }}.</p>
<p>Drive the {{ experiment.channel.value }} valve with a {{ experiment.shape }} of {{ "%.3g"|format(experiment.amplitude) }} V about
{{ "%.3g"|format(experiment.offset) }} V at {{ experiment.frequency_hz }} Hz for {{ "%.0f"|format(experiment.duration_s) }} s.</p>{% endif %}
<h2>Measured and simulated</h2>
<p>The model is driven by the voltages really applied and the pressure really measured. Paths that integrate are re-anchored in
short windows, so that drift does not hide the rest.</p>
{% for p in pictures.run %}{{ p|safe }}{% endfor %}
{% if pictures.validation %}<h2>On the validation run, which no fit has seen</h2>{% for p in pictures.validation %}{{ p|safe }}{% endfor %}{% endif %}
<h2>The gap in figures</h2>
<table><tr><th>channel</th><th class="l">what</th><th>ISE</th><th>RMS</th><th>fit / %</th></tr>
{% for r in rows %}<tr><td>{{ r.channel }}</td><td class="l">{{ r.what }}</td><td>{{ r.ise }}</td><td>{{ r.rms }}</td><td>{{ r.fit }}</td></tr>
{% endfor %}</table>
{% if where %}<h2>Where the gap sits</h2><p>Conditions overlap. Gap of the model with refitted nominal parameters.</p>{% for p in pictures.where %}{{ p|safe }}{% endfor %}{% endif %}
<h2>Candidates</h2><p>Each was fitted jointly with the nominal parameters. "Behind" is twice the log-likelihood behind the chosen one,
complexity paid; under 6 is a tie. One below 0 fits better and was still not chosen: it is grey, or it is a larger set
whose further effect explains too little to be more than the form of the others. Grey ones are outside the vocabulary: they are there so that their traces are not mistaken for a name.</p>
{% for p in pictures.ranking %}{{ p|safe }}{% endfor %}
<details><summary>All figures</summary><table><tr><th>candidate</th><th class="l">channel</th><th>explained / %</th><th>RMS left</th><th>behind</th></tr>
{% for r in ranking %}<tr{% if r.outside %} class="outside"{% endif %}><td>{{ r.names }}</td><td class="l">{{ r.channel }}</td>
<td>{{ r.explained }}</td><td>{{ r.rms }}</td><td>{{ r.behind }}</td></tr>{% endfor %}</table></details>
<h2>Nominal parameters, refitted with the effect</h2>
<table><tr><th>parameter</th><th>value</th><th>95 % from</th><th>to</th></tr>
{% for p in nominal %}<tr><td>{{ p.name }}</td><td>{{ p.value }}</td><td>{{ p.low }}</td><td>{{ p.high }}</td></tr>{% endfor %}</table>
<h2>Reproduce</h2><pre>{% for c in commands %}{{ c }}
{% endfor %}</pre>
<table>{% for name, value in facts %}<tr><td>{{ name }}</td><td class="l">{{ value }}</td></tr>{% endfor %}</table>
<details><summary>The model found (model.yaml)</summary><pre>{{ model_yaml }}</pre></details>
</body></html>
"""
